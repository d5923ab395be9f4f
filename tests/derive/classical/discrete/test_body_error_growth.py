"""Where products of flexible transfer matrices lose their digits: along welded chains, with modes.

The figures stand in docs/explanation/classical-flexible.md; the Riccati sweep of the same chains
keeps its digits.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.classical.welded_chain import (
    ACCELERATION,
    Step,
    exact_root_load,
    root_load,
    section_matrix,
    swept_root_load,
)

#: Modes -> condition of the matrix that elimination inverts, and of the section's 6 x 6 matrix.
CONDITIONS = {1: (1.0, 2e5), 2: (6e2, 3e7), 3: (1e4, 2e9), 4: (8e4, 5e10), 6: (1e6, 5e12)}

#: h = 0.01 s by Newmark's rule, first clamped frequency 25 rad/s.
NEWMARK = Step(A=4e4, C=200.0, stiffness=50.0)


@pytest.mark.parametrize("modes", CONDITIONS)
def test_conditions_grow_with_the_modes(modes: int) -> None:
    whole, inverted = section_matrix(modes)
    expected = CONDITIONS[modes]
    for found, figure in (
        (np.linalg.cond(inverted), expected[0]),
        (np.linalg.cond(whole), expected[1]),
    ):
        assert figure / 1.6 < found < 1.6 * figure


#: Pairs of a section's displacements and loads in [r; theta; m; q].
_PAIRS = ((0, 4), (1, 5), (2, 3))


@pytest.mark.parametrize("step", [ACCELERATION, NEWMARK], ids=["acceleration", "newmark"])
@pytest.mark.parametrize("modes", [1, 2, 3, 4])
def test_section_matrix_is_symplectic_at_rest(modes: int, step: Step) -> None:
    whole, _ = section_matrix(modes, step)
    form = np.zeros((6, 6))
    for move, load in _PAIRS:
        form[move, load], form[load, move] = 1, -1
    size = np.abs(whole).max()
    assert np.abs(whole.T @ form @ whole - form).max() < 1e-14 * size**2
    assert abs(np.linalg.det(whole) - 1) < 1e-14 * np.linalg.cond(whole)


def errors(modes: int, count: int, step: Step) -> tuple[float, float]:
    """Relative errors of the root's load by the product (inf where singular) and by the sweep."""
    exact = exact_root_load(modes, count, step)
    swept = swept_root_load(modes, count, step)
    try:
        product = root_load(modes, count, step)
    except np.linalg.LinAlgError:
        product = np.full(3, np.inf)
    size = np.abs(exact).max()
    return float(np.abs(product - exact).max() / size), float(np.abs(swept - exact).max() / size)


#: (modes, bodies) -> largest and smallest error that the product is expected to have.
GROWTH = {
    (1, 1): (1e-13, 0.0), (1, 3): (1e-10, 0.0), (1, 6): (1e-4, 1e-11), (1, 8): (np.inf, 1e-7),
    (3, 1): (1e-12, 0.0), (3, 2): (1e-9, 0.0), (3, 4): (1e-3, 1e-10), (3, 6): (np.inf, 1e-6),
    (3, 8): (np.inf, 1e-3), (6, 3): (1e-2, 1e-10), (6, 6): (np.inf, 1e-3),
}  # fmt: skip


@pytest.mark.parametrize(("modes", "count"), GROWTH)
def test_product_loses_digits_and_the_sweep_does_not(modes: int, count: int) -> None:
    largest, smallest = GROWTH[modes, count]
    product, swept = errors(modes, count, ACCELERATION)
    assert smallest <= product <= largest
    assert swept < 1e-12


def test_a_step_in_time_loses_them_too() -> None:
    """Stiffness adds to the inertia in Z: later than in the acceleration form, but it does."""
    product, swept = errors(3, 12, NEWMARK)
    assert product > 1e-6
    assert swept < 1e-10
