"""What is known to be bad is reached from the cases of the atlas alone, and is bad as it should."""

from __future__ import annotations

import grimp
import numpy as np
import pytest

import mstmm
from mstmm.atlas.scenes import spinning_top
from mstmm.atlas.variants import raw_quaternions, textbook_shapes
from mstmm.runtime.flexible.beam.shapes import Eigenfunction


def test_only_cases_reach_the_variants() -> None:
    graph = grimp.build_graph("mstmm")
    users = {
        user
        for variant in graph.find_descendants("mstmm.atlas.variants")
        for user in graph.find_modules_that_directly_import(variant)
    } | graph.find_modules_that_directly_import("mstmm.atlas.variants")
    assert users
    assert all(user.startswith("mstmm.atlas.cases.") for user in users)


def test_a_raw_quaternion_turns_as_the_good_one_does() -> None:
    """It differs in length, not in what it says of the attitude."""
    model = spinning_top("ball", (0.4, 1.6, 1.1))
    raw = raw_quaternions.end_of(model, 0.01, 500)
    good = model.simulate(5.0, rtol=1e-12, atol=1e-14, output_times=[5.0]).q[-1]
    assert np.abs(raw / np.linalg.norm(raw) * np.sign(raw @ good) - good).max() < 1e-6


@pytest.mark.parametrize("number", [1, 2, 5])
def test_low_shapes_are_those_of_the_textbook(number: int) -> None:
    xi = np.linspace(0, 1, 21)
    stable = Eigenfunction("clamped-free", number, 0.0, 1.0)(xi)
    printed = textbook_shapes.clamped_free(number, xi)
    sign = np.sign(printed[-1] * stable[-1])
    np.testing.assert_allclose(printed * sign, stable, atol=1e-9)


def test_a_run_offers_none_of_them() -> None:
    with pytest.raises(mstmm.SceneError, match="raw-quaternions"):
        spinning_top("ball").simulate(1.0, "raw-quaternions")
