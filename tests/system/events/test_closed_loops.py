"""Events in closed loops are met by states in which the loops are closed."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.support.scenes.linkages import four_bar


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_an_event_of_a_cut_hinge(engine: str) -> None:
    """By steps so long that what is interpolated errs by 3e-5; the time is that of short steps."""
    event = {"name": "up", "when": "tip.q > 2", "do": "stop"}
    scene = mstmm.Scene(**four_bar(speed=6.0), event=[event])
    model = mstmm.compile(scene, engine=engine)
    place = model.coordinate_layout.hinges["tip"].q
    long, short = (model.simulate(4.0, rtol=rtol, atol=1e-9) for rtol in (1e-4, 1e-9))
    for run in (long, short):
        assert run.message.startswith('stopped by event "up"')
        assert abs(run.q[-1, place] - 2.0) < 1e-14
    assert long.t[-1] == pytest.approx(short.t[-1], abs=3e-6)


def test_an_end_among_loops_is_where_the_loops_put_it() -> None:
    """The tips of coupler and rocker are one point, which crosses a line once."""
    stops = []
    for end in ("coupler.tip", "rocker.tip"):
        event = {"name": "low", "when": f"{end}.y < 0.5", "do": "stop"}
        scene = mstmm.Scene(**four_bar(speed=6.0), event=[event])
        run = mstmm.compile(scene, engine="looped").simulate(4.0, rtol=1e-4)
        assert run.position(end)[-1, 1] == pytest.approx(0.5, abs=1e-13)
        stops.append(run.t[-1])
    assert np.ptp(stops) < 1e-14


@pytest.mark.parametrize("method", ["scipy-LSODA", "scipy-BDF", "scipy-RK45", "sundials-Adams"])
@pytest.mark.parametrize(("upper", "restitution"), [(1.7, 0.4), (1.9, 0.4)])
def test_blows_of_a_mechanism_by_other_integrators(
    method: str, upper: float, restitution: float
) -> None:
    """Closing loops draws what is met back by rounding; it is struck there, once, and flies on: as
    by the package's own loop, whether it comes to rest or not."""
    stop = {"limits": {"upper": upper, "restitution": restitution}}
    scene = mstmm.Scene(**four_bar(speed=6.0, tip={"law": stop}))
    model = mstmm.compile(scene, engine="looped")
    wanted, run = model.simulate(1.5, rtol=1e-11, atol=1e-13), model.simulate(1.5, method)
    assert (run.message == "finished at t = 1.5 s") == (wanted.message == "finished at t = 1.5 s")
    assert run.t[-1] == pytest.approx(wanted.t[-1], abs=2e-4)
    first = (wanted.event > 0).argmax(), (run.event > 0).argmax()
    assert run.t[first[1]] == pytest.approx(wanted.t[first[0]], abs=1e-6)
    assert np.abs(run.q[-1] - wanted.q[-1]).max() < 1e-4
