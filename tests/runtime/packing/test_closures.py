"""Gears, racks, screws, differentials and planets against closed forms; what they cannot be."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.scenes.gears import (
    PLANET,
    RING,
    SUN,
    coupled_model,
    inertia,
    pair,
    pin,
    planetary,
    wheel,
)

Scene = dict[str, Any]
GEAR: Scene = {"name": "gear", "expression": "A.q + 3*B.q"}


def test_gear_pair() -> None:
    model = pair(GEAR, a={"law": {"effort": 1.5}}, b={"law": {"damping": 0.1}})
    wanted = (-3 * 1.5 - 0.1 * 0.7) / (9 * 0.02 + 0.3)
    found = model.accelerations([0.2, -0.1], [-2.1, 0.7])
    assert np.abs(found - wanted * np.array([-3.0, 1.0])).max() < 1e-14
    assert model.loops.constraint_rows == (("gear", "expression"),) and model.loops.mobility == 1


def test_rack_and_pinion() -> None:
    """The rack hangs on the pinion."""
    rack = {"name": "R", "type": "prismatic", "inboard": "ground", "outboard": "rack",
            "axis": [0, 1, 0]}  # fmt: skip
    model = coupled_model(
        [wheel("pinion", 0.05), wheel("rack", 1.0, 4.0)], [pin("P", "pinion"), rack],
        {"expression": "0.2*P.q - R.q"}, gravity=[0, -9.81, 0],
    )  # fmt: skip
    fall = -9.81 / (1 + 0.05 / (4.0 * 0.2**2))
    assert np.abs(model.accelerations([0, 0], [0, 0]) - [fall / 0.2, fall]).max() < 1e-12


def test_screw() -> None:
    """A cylindrical hinge whose coordinates are coupled is a screw."""
    lead, nut = 0.04, wheel("nut", 0.01, 2.0)
    hinge = {"name": "S", "type": "cylindrical", "inboard": "ground", "outboard": "nut",
             "axis": [0, 0, 1]}  # fmt: skip
    row = {"expression": f"S.displacement - {lead}*S.angle"}
    model = coupled_model([nut], [hinge], row, gravity=[0, 0, -9.81])
    names = [str(name) for name in model.coordinate_layout.hinges["S"].q_names]
    fall = -9.81 / (1 + 0.01 / (2.0 * lead**2))
    wanted = {"displacement": fall, "angle": fall / lead}
    found = dict(zip(names, model.accelerations([0, 0], [0, 0]), strict=True))
    assert found == pytest.approx(wanted, rel=1e-14)


def test_differential() -> None:
    """Of the torque on the case each wheel gets half, less what turns its own inertia."""
    moments = {"case": 0.3, "left": 0.05, "right": 0.2}
    model = coupled_model(
        [wheel(name, moment) for name, moment in moments.items()],
        [pin(n, n, law={"effort": 2.0 if n == "case" else 0.0}) for n in moments],
        {"expression": "left.q + right.q - 2*case.q"},
    )
    row = np.array([-2.0, 1.0, 1.0])
    whole = np.block([[np.diag([*moments.values()]), row[:, None]], [row, 0.0]])
    wanted = np.linalg.solve(whole, [2.0, 0, 0, 0])[:3]
    assert np.abs(model.accelerations(np.zeros(3), np.zeros(3)) - wanted).max() < 1e-14


def test_planetary_gear() -> None:
    """Two speeds are left, whatever the number of planets; sun and carrier by Lagrange."""
    efforts = {"sun": 0.3, "ring": -0.7, "carrier": 0.2}
    model = planetary(efforts)
    assert (
        model.loops.mobility == 2 and model.loops.rank == 4 and len(model.loops.redundant_rows) == 2
    )
    ratios = np.array([[1, 0], [-SUN / RING, 1 + SUN / RING], [0, 1]])
    free = np.linalg.solve(inertia(ratios), ratios.T @ [*efforts.values()])
    turns = np.vstack([ratios, [[-SUN / PLANET, 1 + SUN / PLANET]] * 3]) @ free
    turns[3:] -= free[1]
    found = model.accelerations(np.zeros(6), np.zeros(6))
    assert np.abs(found / turns - 1).max() < 1e-12


def test_a_drive_on_one_side() -> None:
    """The drive is asked for what turns both wheels; nothing is left free."""
    model = pair(GEAR, a={"drive": "sin(t)"}, b={"law": {"damping": 0.1}})
    result = model.simulate(2.0, "dop853", rtol=1e-10, output_times=[0.0, 1.0, 2.0])
    assert result.success, result.message
    t = np.array([0.0, 1.0, 2.0])
    assert np.abs(result.q[:, 1] + np.sin(t) / 3).max() < 1e-12
    wanted = -0.02 * np.sin(t) + (0.1 * np.cos(t) / 3 - 0.3 * np.sin(t) / 3) / 3
    assert np.abs(result.effort("A").ravel() - wanted).max() < 1e-12


def test_a_drive_that_lets_go() -> None:
    """The damper stops both wheels once the drive is gone."""
    model = pair(
        GEAR, a={"drive": "t", "release": "t > 0.5"}, b={"law": {"damping": 0.1}}
    )  # fmt: skip
    result = model.simulate(1.0, "dop853", rtol=1e-10, output_times=[0.0, 1.0])
    assert result.success, result.message
    rate = np.exp(-0.1 / 9 * 0.5 / (0.02 + 0.3 / 9))
    assert np.abs(result.u[-1] - [rate, -rate / 3]).max() < 1e-9


def test_starts() -> None:
    """Coordinates that are held stay, others follow; without `equals` all do, whatever they are."""
    wished = {"initial": {"q": 1.0}}
    model = pair(GEAR | {"equals": 0.25}, a=wished | {"hold": True}, b={"initial": {"q": 5.0}})
    assert np.abs(model.initial_state()[0] - [1.0, -0.25]).max() < 1e-12
    model = pair(GEAR, a={"initial": {"q": 1.0, "u": 6.0}}, b={"initial": {"q": 5.0}})
    q, u = model.initial_state()
    assert np.abs(q - [1.0, 5.0]).max() < 1e-15 and np.abs(u - [6.0, -2.0]).max() < 1e-12
    q, u = model.assemble([1.3, 5.0], [0.0, 0.0], hold=["A"])
    assert np.abs(q - [1.3, 4.9]).max() < 1e-12


def test_assembled_at_a_time() -> None:
    """Places and speeds are those that a coupling asks at that time."""
    model = pair(GEAR | {"equals": "0.2*sin(3*t)"})
    for t in (0.0, 0.7):
        q, u = model.assemble([0.4, 0.1], [1.0, 2.0], t=t)
        assert abs(q[0] + 3 * q[1] - 0.2 * np.sin(3 * t)) < 1e-12
        assert abs(u[0] + 3 * u[1] - 0.6 * np.cos(3 * t)) < 1e-12


def test_a_drive_at_a_time() -> None:
    model = pair(GEAR | {"equals": 0}, a={"drive": "0.5*sin(t)"})
    q, u = model.assemble(t=1.2)
    driven = np.array([0.5 * np.sin(1.2), 0.5 * np.cos(1.2)])
    assert np.abs([q[0], u[0]] - driven).max() < 1e-12
    assert np.abs(3 * np.array([q[1], u[1]]) + driven).max() < 1e-12


def test_couplings_that_repeat_others() -> None:
    twice = {"expression": "2*A.q + 6*B.q"}
    model = pair(GEAR, twice)
    assert (
        model.loops.redundant_rows == (("coupling2", "expression"),) and model.loops.mobility == 1
    )
    assert model.loops.rank == 1


SPEEDS: Scene = {"speeds": "A.u + B.u"}
BAD: dict[str, tuple[list[Scene], Scene, Scene, str]] = {
    "values": ([GEAR | {"equals": 0}, {"expression": "2*A.q + 6*B.q", "equals": 1}], {}, {},
               'coupling ".*" cannot be satisfied: the nearest .* gap .*; omit it or another'),
    "rates": ([SPEEDS, {"speeds": "2*A.u + 2*B.u", "equals": 1}], {}, {},
              'coupling "coupling2" contradicts other constraints by 1 at the start; omit it'),
    "held": ([GEAR | {"equals": 0}], {"initial": {"q": 1.0}, "hold": True}, {"hold": True},
             'coupling "gear" cannot be satisfied: .* gap of 1 with "A", "B" fixed'),
    "given speeds": ([GEAR], {"initial": {"u": 1.0}}, {"initial": {"u": 1.0}},
                     'given for "A", "B" are inconsistent by 4 in coupling "gear"; give'),
    "two on one freedom": ([GEAR, {"expression": "A.q + 2*B.q"}], {}, {},
                           'no degrees of freedom .a str.* at "gear", "coupling2"; use'),
    "both driven": ([GEAR], {"drive": "t"}, {"drive": "2*t"},
                    "drives already prescribe A.q and B.q; leave out one drive or"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_refused(case: str) -> None:
    rows, a, b, message = BAD[case]
    with pytest.raises(mstmm.SceneError, match=message):
        pair(*rows, a=a, b=b)


def test_drives_that_part_run_into_the_coupling() -> None:
    """At the start two drives agree, later they do not."""
    model = coupled_model(
        [wheel("a", 0.02), wheel("b", 0.3), wheel("c", 0.1)],
        [pin("A", "a", drive="t^2"), pin("B", "b"), pin("C", "c", drive="t^3")],
        GEAR, {"name": "belt", "expression": "B.q - C.q"},
    )  # fmt: skip
    result = model.simulate(1.0, "dop853")
    assert not result.success
    assert (
        'coupling "belt" at t = ' in result.message and "; check whether drives" in result.message
    )


@pytest.mark.parametrize("asked", ["product", "dttmm"])
def test_what_cannot_follow_yet_names_the_coupling(asked: str) -> None:
    model = pair(GEAR)
    calls: dict[str, Callable[[], object]] = {
        "product": lambda: mstmm.compile(model.scene, sweep="product"),
        "dttmm": lambda: model.simulate(0.1, "dttmm", step=0.01),
    }
    with pytest.raises(mstmm.SceneError, match=r'does not support .*, found .*coupling "gear"; '):
        calls[asked]()
