"""The mass matrix of stiffened bodies over the slopes that their model is made for."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.flexible.mass_definiteness import is_definite_at, is_mass_definite
from mstmm.runtime.flexible.modal_body import ModalBody
from mstmm.runtime.flexible.supports import ANY, Supports
from tests.support.scenes.single_beam import HELD, PIN, body_of

Array = NDArray[np.float64]


def cantilever(parts: int, shapes: int, **beam: Any) -> mstmm.Model:
    """Length 0.5, EI 0.785, pushed suddenly at its end by 1.6 EI/L^2."""
    part: dict[str, Any] = {
        "length": 0.5 / parts,
        "mass_per_length": 2.0,
        "bending_stiffness": np.pi / 4,
    }
    part |= {"modes": {"y": shapes}, **beam}
    inboard = ["ground", *(f"p{k}.tip" for k in range(parts - 1))]
    return mstmm.compile(
        mstmm.Scene(
            gravity=[0, 0, 0],
            beam=[part | {"name": f"p{k}"} for k in range(parts)],
            hinge=[
                {"name": f"w{k}", "type": "fixed", "inboard": inboard[k], "outboard": f"p{k}"}
                for k in range(parts)
            ],
            load=[{"on": f"p{parts - 1}.tip", "force": [0, -5.0, 0]}],
        ),
        engine="looped",
    )


def definite(body: ModalBody, slope: float) -> bool:
    assert body.shapes is not None
    turns = body.shapes.values_at(np.linspace(0, body.shapes.length, 17)).theta
    return is_mass_definite(body, body.ports["root"], ANY, turns * (0.375 / slope))


@pytest.mark.parametrize(
    ("frame", "shapes", "slope"),
    [("tangent", 1, 0.13), ("tangent", 3, 0.03), ("tangent", 5, 0.013), ("chord", 3, 0.21)],
)
def test_the_slope_at_which_it_is_lost(frame: str, shapes: int, slope: float) -> None:
    basis = "simply-supported" if frame == "chord" else "clamped-free"
    body = body_of(HELD, frame=frame, basis=basis, modes={"y": shapes}, quadrature=False)
    assert definite(body, 0.9 * slope)
    assert not definite(body, 1.1 * slope)


@pytest.mark.parametrize("basis", ["clamped-free", "simply-supported", "free-free"])
@pytest.mark.parametrize("modes", [{"y": 1}, {"y": 5}, {"y": 3, "z": 3, "twist": 1}])
def test_the_mean_frame_keeps_it(basis: str, modes: dict[str, int]) -> None:
    body = body_of(HELD, frame="mean", basis=basis, modes=modes, torsional_stiffness=1.0)
    assert definite(body, 0.9)


def test_parts_take_the_mean_frame_where_they_move() -> None:
    frames = [body.frame for body in cantilever(3, 3).flexible_bodies.values()]
    assert frames == ["tangent", "mean", "mean"]
    asked = cantilever(3, 3, frame="tangent").flexible_bodies
    assert [len(body.points) > 0 for body in asked.values()] == [False, True, True]
    assert not any(
        body.points for body in cantilever(3, 3, stiffening=False).flexible_bodies.values()
    )
    straight = cantilever(3, 3, stiffening=False).flexible_bodies
    assert {body.frame for body in straight.values()} == {"tangent"}


@pytest.mark.parametrize("shapes", [3, 4])
def test_welded_parts_run_under_a_sudden_load(shapes: int) -> None:
    """Four parts against six, which agree to 2 per cent."""
    times = np.linspace(0, 0.6, 7)
    tips = [
        cantilever(parts, n).simulate(0.6, output_times=times, rtol=1e-6, atol=1e-8)
        for parts, n in ((4, shapes), (6, 2))
    ]
    assert all(run.success for run in tips)
    coarse, fine = (
        run.position(f"p{parts - 1}.tip") for run, parts in zip(tips, (4, 6), strict=True)
    )
    assert np.abs(coarse - fine).max() < 8e-3
    assert np.abs(fine[:, 1]).max() > 0.3


def test_a_matrix_that_goes_is_named() -> None:
    asked = cantilever(4, 3, frame="tangent", quadrature=False)
    run = asked.simulate(0.6, rtol=1e-6, atol=1e-8)
    assert not run.success
    # At the last good state or in the trial behind it: the words differ.
    assert re.search(r'flexible body "p\d".* is not positive definite', run.message)


def test_rigid_bodies_that_ride_along_count() -> None:
    """A hub on a pin keeps the tangent frame of its blade where it is heavy."""

    def frame(inertia: float) -> str:
        blade = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
                 "modes": {"y": 3}}  # fmt: skip
        hinges = [
            {"name": "axle", "type": "pin", "inboard": "ground", "outboard": "hub"},
            {"name": "root", "type": "fixed", "inboard": "hub.rim", "outboard": "blade"},
        ]
        hub = {"name": "hub", "mass": 1.0, "inertia": [inertia] * 3, "ends": {"rim": [0.1, 0, 0]}}
        scene = mstmm.Scene(gravity=[0, 0, 0], body=[hub], beam=[blade], hinge=hinges)
        return mstmm.compile(scene, engine="looped").flexible_bodies["blade"].frame

    assert frame(5.0) == "tangent"
    assert frame(1e-3) == "mean"


def test_the_inertia_seen_is_that_of_the_engine() -> None:
    """The mass matrix of the whole scene has the pivots that the test looks at."""
    blade: dict[str, Any] = {"name": "blade", "length": 1.0, "mass_per_length": 1.0}
    blade |= {
        "bending_stiffness": 1.0,
        "modes": {"y": 2},
        "frame": "tangent",
        "basis": "clamped-free",
        "quadrature": False,
    }
    hub = {"name": "hub", "mass": 0.0, "inertia": [1e-3] * 3, "ends": {"rim": [0.1, 0, 0]}}
    hinges = [
        {"name": "axle", "inboard": "ground", "outboard": "hub", **PIN},
        {"name": "root", "type": "fixed", "inboard": "hub.rim", "outboard": "blade"},
    ]
    scene = mstmm.Scene(gravity=[0, 0, 0], body=[hub], beam=[blade], hinge=hinges)
    model = mstmm.compile(scene, engine="looped")
    body, support = model.flexible_bodies["blade"], Supports(scene).support_of("blade")
    for size in (0.0, 0.01, 0.02, 0.05, 0.1, 0.2):
        eta = size * np.array([0.5, -1.0])
        matrix = model.mass_matrix([0.0, *eta])
        whole = bool(np.linalg.eigvalsh(matrix)[0] > 0)
        assert is_definite_at(body, body.ports["root"], support, eta[None]) == whole
    assert not whole


@pytest.mark.parametrize(("count", "inertia", "told"), [(1, 0.01, 0), (2, 0.01, 1), (2, 1.0, 0)])
def test_a_frame_that_follows_from_the_number_of_shapes_is_told(
    count: int, inertia: float, told: int
) -> None:
    """An arm on a hub: what its deflection counts from is another frame for two shapes."""
    arm = {"name": "arm", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 10.0,
           "modes": {"y": count}}  # fmt: skip
    hub = {"name": "hub", "mass": 1.0, "inertia": [inertia] * 3}
    hinges = [
        {"name": "axle", "type": "pin", "inboard": "ground", "outboard": "hub"},
        {"name": "weld", "type": "fixed", "inboard": "hub", "outboard": "arm"},
    ]
    for frame, expected in (("auto", told), ("tangent", 0)):
        beam = [arm | {"frame": frame}]
        scene = mstmm.Scene(gravity=[0, 0, 0], beam=beam, body=[hub], hinge=hinges)
        model = mstmm.compile(scene, engine="looped")
        said = "tangent with fewer shapes"
        assert (said in str(model.simulate(1e-3).certificate)) == bool(expected)
        assert (
            any("with fewer shapes" in note for note in model.flexible_bodies["arm"].notes)
            == expected
        )
