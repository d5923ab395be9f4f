"""What closed loops leave free: published mobilities, and random ones by singular values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.random_loops import closure_jacobian, random_mechanism
from tests.reference.tree import read
from tests.support.scenes.linkages import OBLIQUE, bricard, cranks, four_bar, legs
from tests.support.scenes.published_mechanisms import four_bars


def loops(scene: dict[str, Any]) -> Any:
    return mstmm.compile(mstmm.Scene(**scene)).loops


@pytest.mark.parametrize(
    ("scene", "rows", "rank", "mobility"),
    [
        (four_bar(), 5, 2, 1),
        (four_bar(tilt=OBLIQUE), 5, 2, 1),
        (four_bars(5, 0.7), 25, 10, 1),
        (cranks(), 10, 3, 1),
        (cranks(OBLIQUE), 10, 3, 1),
        (bricard(), 5, 4, 1),
        (legs(), 15, 15, 6),
    ],
    ids=["four-bar", "oblique", "five", "cranks", "oblique-cranks", "bricard", "legs"],
)
def test_published_mobilities(scene: dict[str, Any], rows: int, rank: int, mobility: int) -> None:
    """Four-bars in space move as in the plane, a third crank and Bricard's ring move at all."""
    found = loops(scene)
    assert (len(found.constraint_rows), found.rank, found.mobility) == (rows, rank, mobility)
    assert len(found.redundant_rows) == rows - rank
    assert not found.singular


def test_rows_of_windows_pass_few_hinges() -> None:
    """Two rows of a window count, and those of two windows meet at a crank at the most."""
    assert loops(four_bars(200, 0.7)).max_open_rows <= 4


@pytest.mark.parametrize("seed", [31, 36, 38, 39, 40])
def test_random_mechanisms_keep_what_their_rows_leave(seed: int) -> None:
    """Speeds less the rank of all six rows of every closing hinge, by singular values."""
    scene, q, _ = random_mechanism(seed, laws=False)
    tree = read(scene)
    found = loops(scene)
    assert found.mobility == tree.nu - np.linalg.matrix_rank(closure_jacobian(tree, q), tol=1e-8)
    assert found.rank == len(found.constraint_rows) and not found.singular
