"""The page on derivatives runs as written and names every result."""

from __future__ import annotations

import dataclasses

import numpy as np

from mstmm.runtime.model.derivatives import Derivatives
from tests.support.pages import Follow, page_text

PAGE = "docs/howto/derivatives.md"


def test_the_example_is_right(play_page: Follow) -> None:
    page = play_page(PAGE)
    found, model, q = (page.names[name] for name in ("found", "model", "q"))
    assert len(page.printed.splitlines()) >= 6
    assert np.allclose(found.efforts @ model.mass_matrix(q), np.eye(2), atol=1e-12)
    assert np.abs(q - [-np.pi / 2, 0]).max() < 1e-9
    assert (np.linalg.eigvals(found.state_matrix).real < 0).all()  # the elbow's damping
    assert not found.parameters["elbow.law.damping"].any()  # nothing turns


def test_every_result_is_described() -> None:
    text = page_text(PAGE)
    names = [field.name for field in dataclasses.fields(Derivatives)] + ["state_matrix"]
    assert {name for name in names if f"`{name}" not in text} == set()
