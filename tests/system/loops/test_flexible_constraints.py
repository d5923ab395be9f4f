"""Constraints and couplings of what hangs on a beam, against the same beam without them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.jets import Array

Scene = dict[str, Any]

#: A point in space, the normal of a plane and what else rows are made of, m.
POINT, NORMAL, RADIUS = np.array([0.8, -1.0, 0.0]), np.array([1.0, 0.2, 0.0]), 1.4
ON_GROUND = {"type": "distance", "length": 0.9, "position": POINT.tolist()}


def blade_model(ring: float = 0.7, **closing: Any) -> mstmm.Model:
    """A hub on a pin, a blade on it, and a knob on a pin at the tip of the blade."""
    hub = {"name": "hub", "mass": 2.0, "inertia": [0.1, 0.1, 0.1], "ends": {"rim": [0.2, 0, 0]}}
    knob = {"name": "knob", "mass": 0.3, "inertia": [0.01, 0.01, 0.01],
            "ends": {"top": [0.2, 0.05, 0]}}  # fmt: skip
    hinges = [
        {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "hub",
         "initial": {"q": 0.3, "u": -1.0}},
        {"name": "weld", "type": "fixed", "inboard": "hub.rim", "outboard": "blade"},
        {"name": "ring", "type": "pin", "inboard": "blade.tip", "outboard": "knob",
         "initial": {"q": 0.5, "u": ring}},
    ]  # fmt: skip
    blade = {"name": "blade", "length": 1.0, "mass_per_length": 1.2, "bending_stiffness": 20.0,
             "modes": 2}  # fmt: skip
    scene = mstmm.Scene(gravity=[0, -9.81, 0], body=[hub, knob], hinge=hinges, beam=[blade],
                        **closing)  # fmt: skip
    return mstmm.compile(scene, engine="looped")


@cache
def free_blade_model() -> mstmm.Model:
    return blade_model()


def end_position(end: str, q: Array) -> Array:
    """Place of an end of the free blade, m."""
    still = np.zeros(free_blade_model().nu)
    run = free_blade_model().simulate(1e-9, initial=(q, still), output_times=[0.0])
    return np.asarray(run.position(end)[0])


ROWS: dict[str, tuple[dict[str, Any], float, Any]] = {
    "tip to ground": (
        {"constraint": [{"from": "ground", "to": "blade.tip", **ON_GROUND}]}, 0.7,
        lambda q: np.linalg.norm(end_position("blade.tip", q) - POINT),
    ),
    "ground to tip": (
        {"constraint": [{"from": "blade.tip", "to": "ground", **ON_GROUND}]}, 0.7,
        lambda q: np.linalg.norm(end_position("blade.tip", q) - POINT),
    ),
    "behind the blade": (
        {"constraint": [{"type": "distance", "from": "hub", "to": "knob.top", "length": 1.2}]}, 0.7,
        lambda q: np.linalg.norm(end_position("knob.top", q) - end_position("hub", q)),
    ),
    "plane": (
        {"constraint": [{"type": "point-on-plane", "from": "ground", "to": "blade.tip",
                         "normal": NORMAL.tolist(), "offset": 1.0}]}, 0.7,
        lambda q: end_position("blade.tip", q) @ NORMAL,
    ),
    "curve": (
        {"constraint": [{"type": "point-on-curve", "from": "ground", "to": "knob.top", "start": 0.3,
                         "curve": [f"{RADIUS}*cos(s)", f"{RADIUS}*sin(s)", "0"]}]}, 0.7,
        lambda q: np.linalg.norm(end_position("knob.top", q)),
    ),
    "gear": (
        {"coupling": [{"expression": "pin.q - 0.5*ring.q"}]}, -2.0,
        lambda q: q[0] - 0.5 * q[1],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ROWS)
def test_what_closes_acts_along_its_row(name: str) -> None:
    """Efforts that a row adds to the free blade are a multiple of its slopes, by differences, and
    it stays as it is, as energy does."""
    closing, ring, row = ROWS[name]
    one = blade_model(ring, **closing)
    q, u = one.initial_state()
    places = [
        one.coordinate_layout.q_names.index(x) for x in free_blade_model().coordinate_layout.q_names
    ]
    speeds = [
        one.coordinate_layout.u_names.index(x) for x in free_blade_model().coordinate_layout.u_names
    ]
    q_free, u_free = q[places], u[speeds]
    added = one.accelerations(q, u)[speeds] - free_blade_model().accelerations(q_free, u_free)
    efforts = free_blade_model().mass_matrix(q_free) @ added
    sides = [[row(q_free + side * e) for e in np.eye(len(q_free))] for side in (1e-5, -1e-5)]
    slopes = (np.array(sides[0]) - sides[1]) / 2e-5
    assert abs(slopes @ u_free) < 1e-8
    across = efforts - (efforts @ slopes) / (slopes @ slopes) * slopes
    assert np.abs(efforts).max() > 0.01 and np.abs(across).max() < 1e-8 * np.abs(efforts).max()

    run = one.simulate(0.5, rtol=1e-9, output_times=np.linspace(0, 0.5, 6), certify=True)
    kept = [row(one_q[places]) for one_q in run.q]
    assert np.ptp(kept) < 1e-9
    assert run.certificate.energy.relative < 1e-8


def test_a_tip_where_nothing_else_is() -> None:
    """A beam on a pin, its tip on a plane along it: neither moves across it."""
    rail = {"name": "rail", "type": "point-on-plane", "from": "ground", "to": "b.tip",
            "normal": [0, 1, 0], "offset": 0.0}  # fmt: skip
    one = mstmm.compile(mstmm.Scene(
        gravity=[0, -9.81, 0], constraint=[rail],
        beam=[{"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 9.0,
               "modes": {"y": 3}}],
        hinge=[{"name": "foot", "type": "pin", "inboard": "ground", "outboard": "b"}],
    ))  # fmt: skip
    assert (one.loops.rank, one.loops.mobility) == (1, 3)
    run = one.simulate(0.2, rtol=1e-8, output_times=np.linspace(0, 0.2, 5))
    assert np.abs(run.position("b.tip")[:, 1]).max() < 1e-12
    assert np.abs(run.q[:, run.model.coordinate_layout.modal["b"].q_slice]).max() > 1e-3
