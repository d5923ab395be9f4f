"""Linear models and derivatives by code compiled for a scene, against the other ways to them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

import mstmm
from mstmm.runtime.engine import compiled_derivatives
from tests.reference.compare import seeded_scene, worst
from tests.support.scenes.linear import hanging_beam, pendulum

MATRICES = ("M", "C", "K", "V", "W", "A", "K_elastic", "C_damping")
ARRAYS = ("udot", "q", "u", "efforts", "t", "rate_q", "rate_u")
TIME = 0.3
#: An arm driven at its root, whose elbow is pushed by a signal.
DRIVEN = mstmm.Scene(
    gravity=(0, -9.81, 0),
    input=[{"name": "motor", "unit": "N*m", "value": 2.0}],
    signal=[{"name": "gust", "unit": "N", "times": [0, 1], "values": [0, 4]}],
    body=[{"name": name, "mass": 2.0, "center_of_mass": [0.3, 0.1, 0], "inertia": [0.1, 0.2, 0.3],
           "ends": {"tip": [0.6, 0, 0]}} for name in ("upper", "lower")],
    hinge=[{"name": "root", "type": "pin", "axis": [0, 0, 1], "inboard": "ground",
            "outboard": "upper", "drive": "0.5*sin(2*t)"},
           {"name": "elbow", "type": "universal", "axis": [0, 1, 0], "axis2": [1, 0, 0],
            "inboard": "upper.tip", "outboard": "lower",
            "law": {"stiffness": 3.0, "damping": 0.2, "effort": ["motor", "0"]}}],
    load=[{"on": "lower.tip", "force": [0, "gust*t", 0], "axes": "body"}],
)  # fmt: skip


def of_both_engines(scene: mstmm.Scene) -> tuple[mstmm.Model, mstmm.Model]:
    """By code of its own, and by the looped engine."""
    return mstmm.compile(scene, engine="fused"), mstmm.compile(scene, engine="looped")


#: Quaternions with laws, springs and loads; a drive with a signal; shapes of a beam; a body with
#: more speeds than any two in a row have to do with each other.
CASES = ("quaternions", "driven", "beam", "spider")


def case_of(name: str) -> tuple[mstmm.Scene, ArrayLike, ArrayLike]:
    if name == "driven":
        return DRIVEN, [0.1, 0.4, -0.3], [0.5, 1.0, -2.0]
    if name == "beam":
        return hanging_beam(1.0, 2), [0.3, 0.02, -0.01], [0.4, 0.1, 0.2]
    if name == "spider":
        return spider(), np.linspace(-1, 1, 22), np.linspace(2, -1, 22)
    data, q, u = seeded_scene(33, types=("ball", "pin"), most=2)
    return mstmm.Scene(**data), q, u


def spider() -> mstmm.Scene:
    """Eleven legs of two pins each on the ground: 22 speeds."""
    leg = {"mass": 0.5, "center_of_mass": [0.2, 0, 0], "inertia": [0.01, 0.02, 0.02],
           "ends": {"knee": [0.4, 0, 0]}}  # fmt: skip
    pin = {"type": "pin", "law": {"damping": 0.1}}
    legs = range(11)
    hips = [pin | {"name": f"hip{i}", "inboard": "ground", "outboard": f"thigh{i}",
                   "axis": [0, 1, 0.1 * i]} for i in legs]  # fmt: skip
    knees = [pin | {"name": f"knee{i}", "inboard": f"thigh{i}.knee", "outboard": f"shank{i}",
                    "axis": [1, 0, 0.1 * i]} for i in legs]  # fmt: skip
    bodies = [leg | {"name": f"{part}{i}"} for i in legs for part in ("thigh", "shank")]
    return mstmm.Scene(gravity=(0, 0, -9.81), body=bodies, hinge=hips + knees)


@pytest.mark.parametrize("name", CASES)
def test_code_finds_what_the_sweep_finds(name: str) -> None:
    scene, q, u = case_of(name)
    fused, looped = of_both_engines(scene)
    found, wanted = (model.linearize(q, u, TIME) for model in (fused, looped))
    assert found.compiled_state is not None and wanted.compiled_state is None
    for matrix in MATRICES:
        ours, theirs = getattr(found, matrix), getattr(wanted, matrix)
        assert worst(ours, theirs, floor=1.0) < 1e-12, matrix
    np.testing.assert_allclose(found.state.udot, wanted.state.udot, rtol=1e-11, atol=1e-11)
    assert np.array_equal(found.M, found.M.T)
    assert (found.rate_matrix is None) == (wanted.rate_matrix is None)


def test_long_chains_are_left_to_the_sweep() -> None:
    """Text grows with the square of a chain's length."""
    chain = {"name": "row", "count": 30, "inboard": "ground", "end": "tip",
             "body": {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1],
                      "ends": {"tip": [1, 0, 0]}},
             "hinge": {"type": "pin"}}  # fmt: skip
    model = mstmm.compile(mstmm.Scene(gravity=(0, -9.81, 0), chain=[chain]))
    assert not model.fusion.obstacle and model.fusion.ready_linear(True) is None


@pytest.mark.parametrize("name", ["quaternions", "beam"])
def test_derivatives_by_code_are_those_by_directions(name: str) -> None:
    """One state, with extra efforts, and a batch."""
    scene, q, u = case_of(name)
    fused, looped = of_both_engines(scene)
    q, u = np.array(q, float), np.array(u, float)
    extra = np.linspace(-1, 1, len(u))
    given = (q, u, TIME), (q, u, TIME, extra), (np.stack([q, q]), np.stack([u, -u]), TIME)
    for arguments in given:
        found, wanted = fused.derivatives(*arguments), looped.derivatives(*arguments)
        for array in ARRAYS:
            assert worst(getattr(found, array), getattr(wanted, array), floor=1.0) < 1e-11, array


def test_code_is_compiled_once_so_many_states_pay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MSTMM_CACHE", str(tmp_path))
    monkeypatch.setattr(compiled_derivatives, "_SECONDS_PER_PAIR", 1e-4)
    model = mstmm.compile(pendulum())
    by_sweep = 0
    while model.linearize([0.2]).compiled_state is None:
        by_sweep += 1
    assert 3 < by_sweep < 10
    assert mstmm.compile(pendulum()).linearize([0.2]).compiled_state is not None  # from the cache


def test_a_state_that_code_refuses_is_named_by_the_sweep() -> None:
    """A spring whose ends meet pulls nowhere."""
    spring = {"name": "rope", "from": "ground", "to": "bob.tip", "position": [0, -1, 0],
              "law": {"stiffness": 5.0}}  # fmt: skip
    data = pendulum().model_dump(by_alias=True, exclude_none=True) | {"spring": [spring]}
    model = mstmm.compile(mstmm.Scene(**data), engine="fused")
    assert model.linearize([0.1]).compiled_state is not None
    for made in (model.linearize, lambda q: model.derivatives(np.array(q), np.zeros(1))):
        with pytest.raises(mstmm.NumericalFailure, match='spring "rope"'):
            made([0.0])


def test_a_state_that_is_no_number_is_named_though_nothing_depends_on_it() -> None:
    data = {"name": "cart", "mass": 2.0, "inertia": [1, 1, 1]}
    rail = {"name": "rail", "type": "prismatic", "inboard": "ground", "outboard": "cart"}
    model = mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), body=[data], hinge=[rail]), engine="fused")
    assert model.derivatives(np.array([1.0]), np.zeros(1)).efforts[0, 0] == 0.5
    with pytest.raises(mstmm.errors.SceneError, match=r"q\[0\] = nan"):
        model.derivatives(np.array([np.nan]), np.zeros(1))
    with pytest.raises(mstmm.errors.SceneError, match="t = inf"):
        model.derivatives(np.array([1.0]), np.zeros(1), np.inf)
