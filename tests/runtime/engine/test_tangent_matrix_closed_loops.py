"""The tangent of closed loops against differences of the accelerations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.engine.tangent_matrix import TangentMatrix
from tests.reference.random_couplings import random_coupled
from tests.support.scenes.constraints import cycloid, governor, on_a_road
from tests.support.scenes.linkages import bricard, cranks, legs
from tests.support.scenes.published_mechanisms import andrews, four_bars
from tests.system.loops import test_four_bar as pins

Array = np.ndarray[Any, np.dtype[np.float64]]
RNG = np.random.default_rng(3)

#: Drives on a hinge in the tree and on one that is cut, of a linkage that they leave no freedom; a
#: hinge that closes a loop by three speeds, with a rotor and a law on each.
DRIVEN = {"drive": "0.7 + 0.4*sin(3*t)"}
CLOSING = {"drive": f"{pins.angles(0.7)[3]!r} + 0.1*sin(3*t)"}
SLIDING = {
    "type": "planar", "initial": {"q": [0.0, 0.0, pins.angles(0.7)[3]]},
    "law": {"stiffness": [50.0, 70.0, 2.0], "damping": [1.0, 2.0, 0.1],
            "inertia": [0.1, 0.2, 0.03]},
}  # fmt: skip


def driven_where_it_closes() -> dict[str, Any]:
    """The linkage with a drive on the hinge that closes it."""
    scene = pins.linkage("closing_pin", False, closing_pin=CLOSING)
    del scene["hinge"][3]["initial"], scene["hinge"][0]["initial"]["u"]
    return scene


#: Windows side by side, with a spring between two that do not touch.
TIED = four_bars(4, angle=0.7) | {
    "spring": [{"from": "coupler0", "to": "crank3.tip", "law": {"stiffness": 40.0}}]
}


#: Scene, inverse time of the step, how far from a closed state (rad, m).
CASES: dict[str, tuple[dict[str, Any], float, float]] = {
    "laws on a tree": (pins.linkage("rocker_pin"), 37.0, 1e-2),
    "laws on the cut": (pins.linkage("closing_pin"), 37.0, 1e-2),
    "three speeds on the cut": (pins.linkage("closing_pin", closing_pin=SLIDING), 37.0, 1e-2),
    "drive in the tree": (pins.linkage("closing_pin", False, crank_pin=DRIVEN), 37.0, 1e-2),
    "drive on the cut": (driven_where_it_closes(), 37.0, 1e-2),
    "redundant rows": (bricard(), 37.0, 0.0),
    "redundant across loops": (cranks(), 37.0, 0.0),
    "legs": (legs(law=100.0), 37.0, 1e-2),
    "side by side": (TIED, 37.0, 1e-2),
    "loops in one point": (andrews(), 1e5, 1e-5),
    "distances": (governor("constraint"), 37.0, 1e-2),
    "a disc that rolls": (on_a_road(), 37.0, 1e-2),
    "a bead on a wire": (cycloid(0.4), 37.0, 1e-2),
    # Balls and free bodies among those coupled, and hinges that close loops.
    "couplings": (random_coupled(4)[0], 37.0, 1e-2),
    "couplings on cuts": (random_coupled(6)[0], 37.0, 1e-2),
}


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest) -> tuple[mstmm.Model, float, float]:
    scene, s, off = CASES[request.param]
    return mstmm.compile(mstmm.Scene(**scene)), s, off


def differences(f: Callable[[float], Array], h: float) -> Array:
    """f'(0) to the fourth order."""
    return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)


def perturbed_state(model: mstmm.Model, off: float) -> tuple[Array, Array]:
    """A state at a distance `off` from the start, whose speeds violate the loops too."""
    q, u = model.initial_state()
    return q + off * RNG.normal(size=len(q)), u + 100 * off * RNG.normal(size=len(u))


@pytest.mark.parametrize("apart", [False, True])
def test_a_step(case: tuple[mstmm.Model, float, float], apart: bool) -> None:
    """Increments of a step obey the derivatives of the accelerations themselves."""
    model, s, off = case
    q, u = perturbed_state(model, off if apart else 0.0)
    tangent = TangentMatrix(model.looped)
    assert np.abs(tangent.residual(0.3, q, u)).max() < 1e-10
    tangent.factor(s, s)
    free = ~np.array([hinge_is_driven(model, j) for j in range(model.nu)])
    d_q = tangent.coordinates(np.zeros(model.nu), RNG.normal(size=model.nq))
    d_a = RNG.normal(size=model.nu) * free
    x = tangent.solve(np.zeros(model.nu), d_q, d_a)
    d_q, d_a = d_q + tangent.coordinates(x), d_a + s * x
    h = 1e-5 / np.abs(np.concatenate([d_q, x])).max()
    found = differences(lambda e: model.accelerations(q + e * d_q, u + e * x, 0.3), h)
    assert np.abs(d_a - found)[free].max() < 1e-7 * np.abs(found).max()


def hinge_is_driven(model: mstmm.Model, speed: int) -> bool:
    """Whether a drive gives the speed."""
    slots = model.coordinate_layout.hinges
    return any(
        hinge.drive is not None and slots[hinge.name].u == speed for hinge in model.scene.hinge
    )


def test_time(case: tuple[mstmm.Model, float, float]) -> None:
    """What the accelerations change by with the time alone: efforts and drives."""
    model, _, off = case
    q, u = perturbed_state(model, off)
    tangent = TangentMatrix(model.looped)
    tangent.residual(0.3, q, u)
    found = tangent.accelerations_rate()
    wanted = differences(lambda e: model.accelerations(q, u, 0.3 + e), 1e-3)
    free = ~np.array([hinge_is_driven(model, j) for j in range(model.nu)])
    assert np.abs(found - wanted)[free].max() < 1e-8 * max(1.0, np.abs(wanted).max())
