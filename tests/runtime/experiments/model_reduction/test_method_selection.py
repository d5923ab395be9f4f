"""An advice whose models are compared over a window of the run: what comes later counts, too."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.experiments.model_reduction import advise
from mstmm.runtime.experiments.model_reduction.trial_models import ComparisonWindow

BAR = {"name": "bar", "length": 1.0, "mass_per_length": 3.0, "bending_stiffness": 2e5}
#: The run, and the window that a small budget would leave of it, s.
T_END, WINDOW = 4.0, 0.4
ERROR = 1e-3


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(advise, "choose_window", lambda *_: ComparisonWindow(WINDOW, T_END))


def checked_advice(**scene: Any) -> mstmm.Advice:
    given = mstmm.Scene(gravity=[0, -9.81, 0], beam=[BAR], **scene)
    made = mstmm.advise(given, T_END, error=ERROR, rounds=0, budget=600)
    times = np.linspace(0.0, T_END, 201)
    exact = mstmm.compile(given, engine="looped").simulate(
        T_END, output_times=times, method="dop853", rtol=1e-9, atol=1e-11
    )
    ours = mstmm.compile(made.scene, engine="looped").simulate(
        T_END, output_times=times, **made.options
    )
    apart = np.abs(exact.position("bar.tip") - ours.position(made.reduced_name("bar.tip")))
    assert not made.covers_whole_run
    assert apart.max() <= ERROR  # of places in parts of a length of 1 m
    return made


def test_the_integration_is_judged_over_the_whole_run() -> None:
    """A stiff bar that swings ten times as long as models are compared."""
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "bar"}
    made = checked_advice(hinge=[pin | {"initial": {"q": [0.5]}}])
    assert made.bodies[0].model.level == "rigid"
    assert made.error <= ERROR
    assert f"the integration over all of its {T_END:g} s" in made.comparison_text


def test_what_moves_later_stays() -> None:
    """A force across the plane of the motion that begins after the window."""
    link = {
        "name": "link", "mass": 2.0, "inertia": [0.02] * 3, "center_of_mass": [0.15, 0, 0],
        "ends": {"tip": [0.3, 0, 0]},
    }  # fmt: skip
    made = checked_advice(
        body=[link],
        hinge=[
            {"name": "shoulder", "type": "ball", "inboard": "ground", "outboard": "link"},
            {"name": "elbow", "type": "pin", "inboard": "link.tip", "outboard": "bar",
             "law": {"damping": 0.1}},
        ],
        load=[{"on": "link.tip", "force": [0, 0, "where(t > 2, 5*sin(3*(t - 2)), 0)"]}],
    )  # fmt: skip
    assert not made.other_changes
    assert any("after the window" in note for note in made.notes)
