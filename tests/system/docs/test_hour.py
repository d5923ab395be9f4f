"""The hour: what the page says of its two programs is so."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.support.pages import Follow

pytestmark = pytest.mark.slow


@pytest.fixture
def page(play_page: Follow) -> dict[str, Any]:
    """The names that the page leaves behind."""
    return play_page("docs/tutorials/riccati-sweep.md").names


def test_both_programs_agree_with_the_engine_on_a_short_chain(page: dict[str, Any]) -> None:
    state = page["angles"], page["speeds"]
    wanted = page["reference"](3, *state)
    for program in (page["product"], page["sweep"]):
        np.testing.assert_allclose(program(*state), wanted, rtol=1e-12)


def test_the_product_fails_and_the_sweep_does_not(page: dict[str, Any]) -> None:
    product_errors, sweep_errors = page["product_errors"], page["sweep_errors"]
    assert product_errors[3] < 1e-12
    assert product_errors[15] > 1e-10 and product_errors[30] > 1e-5
    assert max(sweep_errors.values()) < 1e-11


def test_the_program_of_the_page_moves_as_the_engine(page: dict[str, Any]) -> None:
    moved = np.cumsum(page["result"].q[-1])
    np.testing.assert_allclose(page["own_angles"], moved, atol=1e-7)
