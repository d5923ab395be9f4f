"""The inlined sine and cosine: absolute error, range, special values, with and without FMA."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from tests.support.kernels.fused_helpers import COMPILERS, WIDTHS, FusedLab

BOUND = 2.3e-16
RANGE = 1200.0
CASES = [(compiler, width) for compiler in COMPILERS for width in WIDTHS]


@pytest.fixture(scope="module", params=CASES, ids=["-".join(case) for case in CASES])
def lab(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> FusedLab:
    compiler, width = request.param
    return FusedLab(tmp_path_factory.mktemp("lab"), [], compiler, WIDTHS[width])


def hard_arguments() -> np.ndarray:
    """Doubles next to the multiples of pi/4, where reduction and quadrants are decided."""
    multiples = np.arange(-1528, 1529) * (np.pi / 4)
    around = [multiples, np.nextafter(multiples, np.inf), np.nextafter(multiples, -np.inf)]
    return np.concatenate(around)


def arguments() -> np.ndarray:
    draw = np.random.default_rng(5)
    small = 10.0 ** draw.uniform(-320, 0, 800)
    found = np.concatenate([
        hard_arguments(), draw.uniform(-RANGE, RANGE, 6000), draw.uniform(-1, 1, 2000), small,
        -small, [0.0, RANGE, -RANGE],
    ])  # fmt: skip
    return np.concatenate([found, np.zeros(-len(found) % 8)])


@pytest.fixture(scope="module")
def exact() -> tuple[np.ndarray, list[mpmath.mpf], list[mpmath.mpf]]:
    x = arguments()
    with mpmath.workdps(40):
        return x, [mpmath.sin(float(v)) for v in x], [mpmath.cos(float(v)) for v in x]


@pytest.mark.parametrize("which", ["four", "lanes"])
def test_absolute_error(
    which: str, lab: FusedLab, exact: tuple[np.ndarray, list[mpmath.mpf], list[mpmath.mpf]]
) -> None:
    x, sines, cosines = exact
    for got, wanted in zip(lab.sines(which, x), (sines, cosines), strict=True):
        # Rounded to two doubles: the difference is exact enough.
        high = np.array([float(v) for v in wanted])
        low = np.array([float(v - float(v)) for v in wanted])
        error = np.abs((got - high) - low)
        assert error.max() <= BOUND, x[error.argmax()]
    sine, _ = lab.sines(which, x)
    tiny = np.abs(x) < 1e-8
    assert (sine[tiny] == x[tiny]).all()


@pytest.mark.parametrize("which", ["four", "lanes"])
def test_beyond_the_range_the_library_is_asked(which: str, lab: FusedLab) -> None:
    x = np.array([1200.5, -1e5, 3e22, 1e300, 0.5, np.inf, np.nan, -np.inf])
    sine, cosine = lab.sines(which, x)
    with np.errstate(invalid="ignore"):
        wanted = np.sin(x), np.cos(x)
    for got, reference in zip((sine, cosine), wanted, strict=True):
        assert np.isnan(got[5:]).all()
        assert np.abs(got[:5] - reference[:5]).max() <= BOUND


def test_far_neighbours_change_nothing(lab: FusedLab) -> None:
    near = np.tile([0.1, 0.2, 0.3, 0.4], 2)
    mixed = near.copy()
    mixed[::2] = 1e9
    for which in ("four", "lanes"):
        for calm, disturbed in zip(lab.sines(which, near), lab.sines(which, mixed), strict=True):
            assert (calm[1::2] == disturbed[1::2]).all()
