"""The page on questions to a model: its numbers are those of a double pendulum by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.support.pages import Follow

pytestmark = pytest.mark.slow
MASS, HALF, LENGTH, INERTIA, GRAVITY = 1.0, 0.5, 1.0, 0.084, 9.81


@pytest.fixture
def page(play_page: Follow) -> dict[str, Any]:
    """The names that the page leaves behind."""
    return play_page("docs/howto/evaluate-a-model.md").names


def weights(q: np.ndarray[Any, Any]) -> list[float]:
    """Moments (2,) that hold both rods against gravity at angles q (2,), the second relative."""
    lower = MASS * GRAVITY * HALF * np.cos(q[0] + q[1])
    return [MASS * GRAVITY * (HALF + LENGTH) * np.cos(q[0]) + lower, lower]


def test_the_mass_matrix_is_that_of_two_rods(page: dict[str, Any]) -> None:
    own, coupled = INERTIA + MASS * HALF**2, MASS * HALF * LENGTH * np.cos(page["q"][1])
    lower = [own + coupled, own]
    expected = [[2 * own + MASS * LENGTH**2 + 2 * coupled, lower[0]], lower]
    np.testing.assert_allclose(page["M"], expected, rtol=1e-12)
    np.testing.assert_allclose(page["M"] @ page["answer"], page["tau"], rtol=1e-12)


def test_efforts_hold_gravity_and_undo_accelerations(page: dict[str, Any]) -> None:
    expected = [weights(q) for q in page["angles"]]
    np.testing.assert_allclose(page["holding"], expected, rtol=1e-12)
    assert np.abs(page["efforts"]).max() < 1e-11 and np.abs(page["pushed"]).max() < 1e-11


def test_a_run_begins_when_it_is_told(page: dict[str, Any]) -> None:
    assert page["result"].t[[0, -1]].tolist() == [2.0, 3.0]
