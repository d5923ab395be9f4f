"""Runs that begin on what was made for an earlier one have the numbers of runs made alone."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.run.run_execution import RunMonitor, StartCache, first_run
from tests.support.paths import EXAMPLES

#: Loose and tight, explicit and implicit, and one that chooses: each leaves something behind.
RUNS = (
    ("dop853", 1e-3), ("rodas4p2", 1e-3), ("auto", 1e-5), ("dopri5", 1e-6), ("rodas4p2", 1e-6),
)  # fmt: skip


def scene(name: str) -> mstmm.Scene:
    """An example, or a mass on a spring whose controller has a state of its own."""
    if name != "controlled slide":
        return mstmm.load_scene(EXAMPLES / name / "scene.toml")
    block = {"name": "block", "mass": 2.0, "inertia": [1, 1, 1]}
    slide = {
        "name": "slide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
        "outboard": "block", "initial": {"q": [0.3]}, "law": {"stiffness": 30.0, "effort": "push"},
    }  # fmt: skip
    regulator = {
        "name": "regulator", "sample_time": 0.05, "inputs": ["slide.q"], "outputs": ["push"],
        "A": [[0.9]], "B": [[0.5]], "C": [[-4.0]], "D": [[-6.0]], "initial": [0.1],
    }  # fmt: skip
    return mstmm.Scene(
        gravity=(0, 0, 0), body=[block], hinge=[slide], input=[{"name": "push", "value": 0.0}],
        controller=[regulator],
    )  # fmt: skip


@pytest.mark.parametrize(
    "name",
    ["driven_release", "arm_with_limits", "flexible_arm_control", "four_bar", "controlled slide"],
)
def test_runs_one_after_the_other_are_those_made_alone(name: str) -> None:
    model = mstmm.compile(scene(name), engine="looped")
    q, u = model.initial_state()
    shared, times = StartCache(), tuple(np.linspace(0.0, 2.0, 21).tolist())
    for method, rtol in RUNS:
        settings = Settings(2.0, 0.0, method, None, rtol, 1e-2 * rtol, times)
        one = first_run(model, settings, q, u, RunMonitor(None, settings), beginnings=shared)
        alone = first_run(model, settings, q, u, RunMonitor(None, settings))
        assert one.success and one.statistics == alone.statistics
        for part in ("t", "q", "u", "work", "memory"):
            np.testing.assert_array_equal(getattr(one, part), getattr(alone, part))
