"""Charts of mechanisms: methods that follow closed loops, against a closed form."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.support.scenes.chart import GRAVITY, swing
from tests.support.scenes.linkages import cranks
from tests.system.loops.test_flexible_against_tree import slider_crank

T_END, SAMPLES, AWAY = 2.0, 21, 1.0
#: What follows loops, by speeds and by positions, and what does not.
METHODS = ("dop853", "rk4", "rodas4p2", "genalpha-index3")
LEFT_OUT = ("dttmm", "exprb32")


def test_errors_are_those_of_the_closed_form() -> None:
    """Three cranks of 0.6 m and a coupler of 1 kg each, one crank too many, swing as a pendulum."""
    model = mstmm.compile(mstmm.Scene(**cranks(angle=AWAY - np.pi / 2)), engine="looped")
    made = mstmm.chart(
        model, T_END, quantities=("foot0.angle",), methods=(*METHODS, *LEFT_OUT), samples=SAMPLES,
        rounds=1, budget=300,
    )  # fmt: skip
    times = np.linspace(0.0, T_END, SAMPLES)
    faster = np.sqrt((3 / 2 + 1) / (0.6 * (3 / 3 + 1)))  # than one point at 1 m
    exact = swing(times * faster, AWAY) - np.pi / 2
    assert GRAVITY == 9.81 and made.reference.error < 1e-10
    compared = set()
    for point in made.points:
        if point.error is None or point.error < 1e-8:
            continue
        result = model.simulate(T_END, output_times=times, **point.setting.options)
        true = np.abs(result.coordinates("foot0")[:, 0] - exact).max()
        assert point.error == pytest.approx(true, abs=1e-9)
        compared.add(point.method)
    assert compared == set(METHODS)
    assert [level.degrees_of_freedom for level in made.model_levels] == [1]
    refused = {one.method: one.reason for one in made.skipped if one.is_unsupported}
    assert set(refused) == set(LEFT_OUT)
    assert all("does not support closed loops" in reason for reason in refused.values())


def test_levels_of_a_rod_that_bends() -> None:
    """From a rigid one to two shapes."""
    made = mstmm.chart(
        mstmm.Scene(**slider_crank()), 0.1, methods=("dop853",), models=True, samples=11,
        rounds=0, budget=300,
    )  # fmt: skip
    found = {level.name: level for level in made.model_levels}
    sizes = [found[name].degrees_of_freedom for name in ("rigid", "stiffened, 2 shapes")]
    assert sizes == [1, 3]
    errors = [found[name].error for name in ("rigid", "linear, 2 shapes", "stiffened, 2 shapes")]
    assert all(error is not None for error in errors)
    assert errors[0] > 10 * errors[1] > 10 * errors[2]  # type: ignore[operator]
