"""Functions of a matrix by which exponential methods step, against 60 digits of mpmath."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cffi
import mpmath
import numpy as np
import pytest
from numpy.random import Generator

from mstmm.array_validation import Array
from tests.support.integration.compiled_systems import INTEGRATION
from tests.support.kernels.c_library import compile_library


@dataclass
class Moved:
    """w' = X w + c_0 + c_1 theta + c_2 theta^2 / 2 from rest, X (n, n), as the C has it."""

    ffi: Any
    lib: Any
    phi: Any
    n: int

    def _evaluate(self, name: str, argument: float) -> Array:
        found = np.zeros(self.n)
        call = getattr(self.lib, f"mstmm_phi_{name}")
        call(self.phi, argument, self.ffi.from_buffer("double[]", found))
        return found

    def part(self, k: int) -> Array:
        """phi_(k+1)(X) c_k."""
        return self._evaluate("part", k)

    def value_at(self, theta: float) -> Array:
        """w(theta)."""
        return self._evaluate("at", theta)


class Library:
    """`phi_functions.c` alone."""

    def __init__(self, folder: Path) -> None:
        self.ffi: Any = cffi.FFI()
        lines = (INTEGRATION / "phi_functions.h").read_text().splitlines()
        self.ffi.cdef("\n".join(line for line in lines if not line.startswith("#")))
        target = compile_library([INTEGRATION / "phi_functions.c"], folder / "phi.so", "-O2")
        self.lib: Any = self.ffi.dlopen(str(target))
        self.kept: list[Any] = []

    def prepare_functions(self, X: Array, h: float = 1.0) -> tuple[Any, int]:
        """Phi functions of h X, and the status code of the C."""
        n = len(X)
        numbers = self.ffi.from_buffer("double[]", np.zeros(self.lib.mstmm_phi_size(n)))
        phi = self.ffi.new("mstmm_phi *", self.lib.mstmm_phi_lay(n, numbers))
        self.kept.append(numbers)
        return phi, self.lib.mstmm_phi_prepare(phi, h, self.pointer(X))

    def forced_motion(self, X: Array, c: Array) -> Moved:
        """Motion from rest under the polynomial of the coefficients c (3, n)."""
        phi, code = self.prepare_functions(X)
        assert code == 0
        for k in range(3):
            self.lib.mstmm_phi_force(phi, k, self.pointer(c[k]))
        return Moved(self.ffi, self.lib, phi, len(X))

    def pointer(self, array: Array) -> Any:
        """`double *` to a copy that stays."""
        self.kept.append(self.ffi.from_buffer("double[]", np.array(array, order="C")))
        return self.kept[-1]


@pytest.fixture(scope="module")
def phi(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return Library(tmp_path_factory.mktemp("phi"))


def exact(X: Array, c: Array, theta: float = 1.0) -> Array:
    """w(theta) as one exponential of n + 3 rows."""
    n = len(X)
    whole = np.zeros((n + 3, n + 3))
    whole[:n, :n], whole[:n, n:] = X, c[::-1].T
    whole[n, n + 1] = whole[n + 1, n + 2] = 1.0
    with mpmath.workdps(60):
        found = mpmath.expm(mpmath.matrix(whole.tolist()) * mpmath.mpf(theta))
        return np.array([float(found[i, n + 2]) for i in range(n)])


def part_exact(X: Array, c: Array, k: int) -> Array:
    alone = np.zeros_like(c)
    alone[k] = c[k]
    return exact(X, alone)


def oscillators(*frequencies: float) -> tuple[Array, Array]:
    """Coordinates and speeds with masses that are all coupled, and the units in which they swing
    alike."""
    n, w = len(frequencies), np.array(frequencies)
    mix = np.eye(n) + 0.3 * np.cos(np.add.outer(np.arange(n), 2.0 * np.arange(n)))
    X = np.zeros((2 * n, 2 * n))
    X[:n, n:], X[n:, :n] = np.eye(n), -np.linalg.solve(mix @ mix.T, np.diag(w**2))
    return X, np.append(np.ones(n), np.full(n, w.max()))


def cases(rng: Generator) -> dict[str, tuple[Array, Array]]:
    """Matrices, and units in which errors are told."""
    jordan = np.diag(np.full(5, -0.3)) + np.diag(np.full(4, 7.0), 1)
    found = {
        "small": 1e-3 * rng.normal(size=(4, 4)), "random": rng.normal(size=(7, 7)),
        "larger": 4.0 * rng.normal(size=(9, 9)), "none": np.zeros((3, 3)), "one": np.eye(1),
        "defective": jordan, "nilpotent": np.diag(np.full(4, 3.0), 1),
        "turning": np.array([[0.0, 1e6], [-1e6, 0.0]]),
        "decaying": np.diag([-1e6, -1e3, -1.0]) + np.triu(np.ones((3, 3)), 1),
    }  # fmt: skip
    swinging = {
        "slow": oscillators(3.0, 5.0), "apart": oscillators(1.0, 30.0, 1e3, 2e4),
        "fast": oscillators(1e6), "free and fast": oscillators(0.0, 1e6),
    }  # fmt: skip
    return {name: (X, np.ones(len(X))) for name, X in found.items()} | swinging


@pytest.mark.parametrize("name", cases(np.random.default_rng(0)))
def test_phi_times_vectors(phi: Library, name: str, rng: Generator) -> None:
    """To 1e-13 of what a vector that nothing turns would be, in the units of the matrix."""
    X, unit = cases(rng)[name]
    c = unit * rng.normal(size=(3, len(X)))
    moved = phi.forced_motion(X, c)
    for k in range(3):
        expected = part_exact(X, c, k)
        size = max(np.abs(c[k] / unit).max(), np.abs(expected / unit).max())
        assert np.abs((moved.part(k) - expected) / unit).max() < 1e-13 * size, k


@pytest.mark.parametrize("name", cases(np.random.default_rng(0)))
def test_the_way_there(phi: Library, name: str, rng: Generator) -> None:
    """Earlier on the way, near both ends too, and where it ends."""
    X, unit = cases(rng)[name]
    c = unit * rng.normal(size=(3, len(X)))
    moved = phi.forced_motion(X, c)
    for theta in (0.0, 1e-9, 0.3777, 0.5, 1 - 2**-30):
        expected = exact(X, c, theta)
        size = max(np.abs(c / unit).max(), np.abs(expected / unit).max())
        assert np.abs((moved.value_at(theta) - expected) / unit).max() < 1e-13 * size, theta
    whole = sum(moved.part(k) for k in range(3))
    size = max(np.abs(c / unit).max(), np.abs(whole / unit).max())
    assert np.abs((moved.value_at(1.0) - whole) / unit).max() < 1e-13 * size


def test_slow_motion_keeps_its_digits_beside_fast_one(phi: Library) -> None:
    X = np.diag([-1e6, -1.0, 1e-3])
    moved = phi.forced_motion(X, np.ones((3, 3)))
    expected = -np.expm1(np.diag(X)) / -np.diag(X)
    assert moved.part(0) == pytest.approx(expected, rel=4e-16)


@pytest.mark.parametrize("size", [np.nan, np.inf, 1e300])
def test_what_leaves_nothing_but_rounding_is_refused(phi: Library, size: float) -> None:
    _, code = phi.prepare_functions(np.array([[0.0, 1.0], [-1.0, 0.0]]), size)
    assert code == 1
