"""What lies on an event that throws back is not thrown back by it: a run says so and ends there."""

from __future__ import annotations

from typing import Any

import pytest

import mstmm

SAID = "holds, and the motion continues into it"
BOUNCE = {"event": [{"name": "floor", "when": "slide.q <= 0", "do": "bounce", "restitution": 0.5}]}
STOP = {"lower": 0.0, "restitution": 0.5}


def block(speed: float = 0.0, gravity: float = 0.0, stop: Any = None) -> dict[str, Any]:
    """A block on the floor that `push` holds up or presses down."""
    law = {"effort": "push"} | ({} if stop is None else {"limits": stop})
    return {
        "gravity": [gravity, 0, 0], "input": [{"name": "push", "value": 1.0}],
        "body": [{"name": "block", "mass": 1.0, "inertia": [1, 1, 1]}],
        "hinge": [{"name": "slide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
                   "outboard": "block", "law": law, "initial": {"u": speed}}],
        **({} if stop else BOUNCE),
    }  # fmt: skip


@pytest.mark.parametrize("stop", [None, STOP], ids=["event", "hard stop"])
@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_a_session_whose_input_presses_on_the_floor(engine: str, stop: Any) -> None:
    """The start is taken, for the input takes the block away; then it is set to press."""
    session = mstmm.compile(mstmm.Scene(**block(stop=stop)), engine=engine).session()
    with pytest.raises(mstmm.NumericalFailure, match=SAID):
        session.advance(1.0, {"push": -5.0})
    assert session.q[0] == 0.0


@pytest.mark.parametrize("stop", [None, STOP], ids=["event", "hard stop"])
def test_an_input_that_lets_go_lets_fly(stop: Any) -> None:
    """As long as it takes the block away, it flies: x = t^2 / 2."""
    session = mstmm.compile(mstmm.Scene(**block(stop=stop))).session()
    session.advance(1.0, {"push": 1.0})
    assert session.q[0] == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize("method", ["rk4", "genalpha", "newmark"])
def test_flights_that_are_too_short_for_a_fixed_step(method: str) -> None:
    """Blows follow within parts of a step that nobody looks at: the block fell through."""
    model = mstmm.compile(mstmm.Scene(**block(speed=1e-5, gravity=-20.0)))
    result = model.simulate(1.0, method, step=0.01)
    assert not result.success
    assert "floor" in result.message
    assert SAID in result.message
    assert result.q.min() > -1e-12


@pytest.mark.parametrize(
    ("method", "speed"),
    [("dop853", 1e-5), ("rodas4p2", 1e-5), ("scipy-DOP853", 1e-5), ("scipy-LSODA", 2e-9)],
)
def test_what_hardly_leaves_the_floor_stays_above_it(method: str, speed: float) -> None:
    """By what is seen of its flights it comes to rest, or is told to lie there."""
    model = mstmm.compile(mstmm.Scene(**block(speed=speed, gravity=-20.0)))
    result = model.simulate(1.0, method)
    assert "at rest" in result.message
    assert result.q.min() > -1e-6


def test_the_first_flight_is_seen() -> None:
    """It takes 2 u / a = 1e-6 s of a first step of 1e-3 s."""
    model = mstmm.compile(mstmm.Scene(**block(speed=9.5e-6, gravity=-20.0)))
    result = model.simulate(1.2e-6, "rk4", step=1e-3)
    hit = result.trajectory.event > 0
    assert result.t[hit] == pytest.approx([1e-6], rel=1e-6)
    assert result.u[hit, 0] == pytest.approx([4.75e-6], rel=1e-6)


def test_one_of_a_batch() -> None:
    model = mstmm.compile(mstmm.Scene(**block(gravity=-20.0)))
    starts = [[0.0], [0.5]], [[1e-5], [0.0]]
    batch = model.simulate_batch(starts, t_end=0.1, method="rk4", step=0.01)
    assert list(batch.success) == [False, True]
    assert SAID in batch.messages[0]
