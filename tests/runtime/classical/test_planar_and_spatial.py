"""The form of the plane: it is taken where a scene lies and moves in one, and says the same."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.classical import planar_and_spatial
from mstmm.runtime.run import classical_run
from tests.support.scenes.classical import beam, rods, tree

RICCATI, PRODUCT = "dttmm-classical", "dttmm-classical-product"
SPRINGS = {"stiffness": [500, 400, 450, 30, 20, 25], "damping": [5, 5, 5, 0.3, 0.2, 0.1]}
#: A hinge and its start, in the plane of x and y.
PLANE: dict[str, dict[str, Any]] = {
    "fixed": {},
    "pin": {"axis": [0, 0, 1], "initial": {"q": [0.3], "u": [1.0]}},
    "ball": {"initial": {"q": [1, 0, 0, 0], "u": [0, 0, 0.5]}},
    "elastic": {
        "law": SPRINGS, "initial": {"q": [0, 0, 0, 1, 0, 0, 0], "u": [0.1, 0, 0, 0, 0, 0.2]},
    },
    "free": {"initial": {"q": [0, 0, 0, 1, 0, 0, 0], "u": [0.1, 0.2, 0, 0, 0, 0.5]}},
}  # fmt: skip


def planar_scene(held: str, kind: str, modes: int, outboard: str = "rigid") -> mstmm.Scene:
    """A beam and what hangs on it."""
    hinges = [
        {"name": "h0", "type": held, "inboard": "ground", "outboard": "a"} | PLANE[held],
        {"name": "h1", "type": kind, "inboard": "a.tip", "outboard": "b"} | PLANE[kind],
    ]
    rigid = {
        "name": "b", "mass": 0.5, "center_of_mass": [0.2, 0.1, 0], "inertia": [0.02, 0.03, 0.05],
    }  # fmt: skip
    shapes = {"y": modes}
    beams = [beam("a", shapes, bending_stiffness=5.0)]
    if outboard == "beam":
        beams.append(beam("b", shapes, bending_stiffness=5.0))
    return mstmm.Scene(
        gravity=[0, -9.81, 0], beam=beams, body=[] if outboard == "beam" else [rigid], hinge=hinges
    )


@pytest.fixture
def planar_flags(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether each run was planar."""
    found: list[bool] = []

    def form_of(*given: Any) -> planar_and_spatial.Form:
        form = planar_and_spatial.select_form(*given)
        found.append(form.planar)
        return form

    monkeypatch.setattr(classical_run, "select_form", form_of)
    return found


def in_space(monkeypatch: pytest.MonkeyPatch) -> None:
    def spatial(parts: Any, start: Any, gravity: Any, names: Sequence[str], size: float) -> Any:
        return planar_and_spatial.Spatial(parts, names)

    monkeypatch.setattr(classical_run, "select_form", spatial)


HINGES = ("fixed", "pin", "ball", "elastic")


@pytest.mark.parametrize("held", [*HINGES, "free"])
@pytest.mark.parametrize("kind", HINGES)
def test_plane_and_space_say_the_same(
    held: str, kind: str, planar_flags: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    model = mstmm.compile(planar_scene(held, kind, 1))
    plane = model.simulate(0.2, mstmm.methods.ClassicalDiscreteTime(RICCATI, iterations=20), 0.005)
    assert planar_flags == [True]
    in_space(monkeypatch)
    space = model.simulate(0.2, mstmm.methods.ClassicalDiscreteTime(RICCATI, iterations=20), 0.005)
    assert plane.success and space.success
    assert plane.q == pytest.approx(space.q, abs=1e-8)
    assert plane.u == pytest.approx(space.u, abs=1e-6)


@pytest.mark.parametrize("outboard", ["rigid", "beam"])
@pytest.mark.parametrize("kind", HINGES)
@pytest.mark.parametrize("held", ["fixed", "pin", "elastic"])
def test_beams_with_three_shapes_tend_to_the_ordinary_engine(
    held: str, kind: str, outboard: str
) -> None:
    model = mstmm.compile(planar_scene(held, kind, 3, outboard))
    exact = model.simulate(0.1, rtol=1e-11, atol=1e-12, output_times=[0.1])
    errors = []
    for step in (2e-4, 1e-4):
        run = model.simulate(0.1, RICCATI, step, output_times=[0.1])
        errors.append(float(np.abs(run.q[-1] - exact.q[-1]).max()))
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] > 2.8


@pytest.mark.parametrize("outboard", ["rigid", "beam"])
@pytest.mark.parametrize("kind", HINGES)
@pytest.mark.parametrize("held", ["fixed", "pin", "elastic"])
def test_product_and_riccati_agree_in_the_plane(held: str, kind: str, outboard: str) -> None:
    model = mstmm.compile(planar_scene(held, kind, 3, outboard))
    runs = [model.simulate(0.05, method, 0.005) for method in (RICCATI, PRODUCT)]
    assert all(run.success for run in runs)
    assert runs[1].q == pytest.approx(runs[0].q, abs=1e-7)


def test_a_plane_is_taken_only_where_all_lies_in_it(planar_flags: list[bool]) -> None:
    double = mstmm.compile(rods(2))
    double.simulate(0.02, RICCATI, 0.01)
    mstmm.compile(tree(["pin"])).simulate(0.02, RICCATI, 0.01)
    balls = mstmm.compile(rods(2, "ball"))
    balls.simulate(0.02, RICCATI, 0.01)
    q, u = balls.initial_state()
    u[0] = 0.1
    balls.simulate(0.02, RICCATI, 0.01, initial=(q, u))
    assert planar_flags == [True, False, True, False]


def test_a_pendulum_of_a_beam_errs_as_its_scheme_does() -> None:
    """Simply supported shapes, horizontal start, 1 s: second order where the steps resolve them,
    and the stiff beam's rigid motion where they do not."""
    for stiffness, steps, worst in (
        (5.0, (0.02, 0.01, 0.001), (1e-2, 3e-3, 2e-4)), (500.0, (0.02, 0.01), (4e-4, 1e-4)),
    ):  # fmt: skip
        pendulum = beam(
            "a", {"y": 3}, bending_stiffness=stiffness, frame="chord", basis="simply-supported"
        )
        pin = {"name": "h", "type": "pin", "inboard": "ground", "outboard": "a", "axis": [0, 0, 1]}
        model = mstmm.compile(mstmm.Scene(gravity=[0, -9.81, 0], beam=[pendulum], hinge=[pin]))
        exact = model.simulate(1.0, rtol=1e-11, atol=1e-12, output_times=[1.0])
        for step, bound in zip(steps, worst, strict=True):
            run = model.simulate(1.0, RICCATI, step, output_times=[1.0])
            off = run.position("a.tip")[-1] - exact.position("a.tip")[-1]
            assert np.linalg.norm(off) < bound
