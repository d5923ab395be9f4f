"""A heavy slider behind a light flexible rod: refined, against the same with the rod cut off it."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm

from .test_against_tree import slider_crank


def behind(mass: float, cut: str) -> mstmm.Model:
    """The slider-crank with a slider of so many kg; with `guide` cut it hangs behind the rod."""
    scene = slider_crank(cut)
    scene["body"][1] |= {"mass": mass, "inertia": [1e-3 * mass] * 3}
    return mstmm.compile(mstmm.Scene(**scene), engine="looped")


@pytest.mark.parametrize(("mass", "least"), [(1e4, 1e-11), (1e8, 1e-7), (1e10, 1e-5)])
def test_it_loses_no_digits(mass: float, least: float) -> None:
    answers = []
    for cut in ("guide", "wrist"):
        model = behind(mass, cut)
        start = model.simulate(1e-6, output_times=[0.0, 1e-6])
        state = start.q[0], start.u[0]
        answers.append(np.sort(np.abs(model.accelerations(*state))))
        packed = model.looped.packed.model
        assert (packed.refines > 0) == (cut == "guide")
        if packed.refines:
            packed.refines = 0
            plain = np.sort(np.abs(model.accelerations(*state)))
    size = answers[1].max()
    print(np.abs(plain - answers[1]).max() / size, np.abs(answers[0] - answers[1]).max() / size)
    assert np.abs(plain - answers[1]).max() > least * size
    assert np.abs(answers[0] - answers[1]).max() < 1e-11 * size
