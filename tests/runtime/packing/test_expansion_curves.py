"""Loads and events that read how far a point has come along its curve."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate

import mstmm
from tests.support.scenes.constraints import Scene

#: Slope of a straight wire, what the wind gives by the way, and what drags, N and N s.
SLOPE, WIND, DRAG = 0.5, 0.1, 0.7


def bead(when: str) -> Scene:
    """1 kg on a straight wire; s is x."""
    return {
        "gravity": [0, -9.81, 0],
        "body": [{"name": "bead", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}],
        "hinge": [{"name": "free", "type": "free", "inboard": "ground", "outboard": "bead"}],
        "constraint": [{"name": "wire", "type": "point-on-curve", "from": "ground", "to": "bead",
                        "curve": ["s", f"-{SLOPE}*s", "0"]}],
        "load": [{"name": "wind", "on": "bead",
                  "force": [f"{WIND}*wire.s - {DRAG}*wire.s_rate", 0, 0]}],
        "event": [{"name": "there", "when": when, "do": "stop"}],
    }  # fmt: skip


@pytest.mark.parametrize(("when", "entry"), [("wire.s > 1", 0), ("wire.s_rate > 1", 1)])
def test_a_bead_against_its_own_equation(when: str, entry: int) -> None:
    """(1 + slope^2) s'' = g slope + wind s - drag s', by SciPy."""

    def rates(t: float, y: np.ndarray[tuple[int], np.dtype[np.float64]]) -> list[float]:
        push = 9.81 * SLOPE + WIND * y[0] - DRAG * y[1]
        return [float(y[1]), float(push) / (1 + SLOPE**2)]

    def stop_condition(t: float, y: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
        return float(y[entry]) - 1.0

    stop_condition.terminal = True  # type: ignore[attr-defined]
    found = scipy.integrate.solve_ivp(
        rates, (0.0, 2.0), [0.0, 0.0], "DOP853", events=stop_condition, rtol=1e-12, atol=1e-13
    )
    run = mstmm.compile(mstmm.Scene(**bead(when)), engine="looped").simulate(2.0, rtol=1e-10)
    assert "stopped by event" in run.message
    assert run.t[-1] == pytest.approx(found.t[-1], abs=1e-8)
    assert [run.q[-1, -1], run.u[-1, -1]] == pytest.approx(found.y[:, -1], abs=1e-8)


@pytest.mark.parametrize("when", ["wire.q > 1", "wire.s[0] > 1", "wire.x > 1"])
def test_what_a_curve_does_not_have(when: str) -> None:
    with pytest.raises(mstmm.SceneError, match=r"unknown; .* has wire.s and wire.s_rate"):
        mstmm.Scene(**bead(when))


METHODS: dict[str, dict[str, float]] = {
    "rk4": {"step": 1e-3}, "dopri5": {}, "auto": {}, "rodas5p": {}, "kvaerno5": {},
    "genalpha": {"step": 1e-3}, "genalpha-index3": {"step": 1e-3}, "scipy-DOP853": {},
    "scipy-BDF": {},
}  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("power", "arrives"), [(0.5, 0.55), (1.5, 0.44)])
def test_a_curve_that_ends_on_the_way_is_named(method: str, power: float, arrives: float) -> None:
    """A wire that is there up to s = 1 alone, and stands upright or lies flat there."""
    scene = bead("wire.s > 9")
    scene["constraint"][0] |= {"curve": ["s", f"(1-s)^{power}", "0"], "start": 0.5}
    scene["hinge"][0]["initial"] = {"q": [0.5, 0.5**power, 0, 1, 0, 0, 0], "u": [0] * 6}
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    run = model.simulate(3.0, method, **METHODS[method])  # type: ignore[arg-type]
    assert not run.success and run.t[-1] == pytest.approx(arrives, abs=2e-3)
    told = f'constraint "wire": curve[1] = "(1-s)^{power}" ends at s = 1, which the motion reaches'
    assert run.message.startswith(told) and "; keep it finite" in run.message


def test_a_run_that_fails_far_from_the_end_of_a_curve_does_not_name_it() -> None:
    """The wind stops being a number at s = 0.8."""
    scene = bead("wire.s > 9")
    scene["constraint"][0] |= {"curve": ["s", "sqrt(1-s)", "0"], "start": 0.5}
    scene["hinge"][0]["initial"] = {"q": [0.5, 0.5**0.5, 0, 1, 0, 0, 0], "u": [0] * 6}
    scene["load"][0]["force"] = ["sqrt(0.8-wire.s)", 0, 0]
    run = mstmm.compile(mstmm.Scene(**scene), engine="looped").simulate(3.0, "dopri5")
    assert not run.success and 'load "wind": force[0]' in run.message
    assert "ends at" not in run.message
