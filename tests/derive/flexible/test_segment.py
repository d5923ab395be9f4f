"""A segment of an exact beam: its pose against the matrix exponential, its rates by differences.

The pose is composed here from 4 x 4 matrices and brackets of matrices; only the kernels come from
the derivation.
"""

import itertools
from typing import Any

import mpmath
import pytest

from mstmm.derive.catalogue.kernels import modal_kernels
from mstmm.derive.verification.kernel_evaluation import PreciseArithmetic
from mstmm.ir.interpreter import replay_kernel

mp: Any = mpmath.mp
DIGITS, N = 50, 3
KERNELS = {kernel.name: kernel for kernel in modal_kernels() if kernel.name.startswith("segment")}


def _hat(x: Any) -> Any:
    """4 x 4 matrix of a twist with rows v then w."""
    v, w = x[:3], x[3:]
    return mp.matrix(
        [[0, -w[2], w[1], v[0]], [w[2], 0, -w[0], v[1]], [-w[1], w[0], 0, v[2]], [0, 0, 0, 0]]
    )


def _vee(a: Any) -> list[Any]:
    return [a[0, 3], a[1, 3], a[2, 3], a[2, 1], a[0, 2], a[1, 0]]


def _commutator(a: Any, b: Any) -> Any:
    return a * b - b * a


class _Segment:
    """Drawn data of one segment, its pose as a function of time, and the outputs of its kernels."""

    def __init__(self, seed: int, size: float) -> None:
        draw = itertools.count(seed)

        def value() -> Any:
            return size * (mp.frac(mp.sqrt(2) * (7 * next(draw) + 3)) - mp.mpf(1) / 2)

        self.rest = [value() for _ in range(18)]
        self.shapes = [[value() for _ in range(N)] for _ in range(18)]
        self.eta, self.etad, self.etadd = ([value() for _ in range(N)] for _ in range(3))
        axis = mp.matrix([0, 0, 0, value(), value(), value()])
        self.end = mp.expm(_hat(axis))

    def pose(self, t: Any) -> Any:
        """Pose of the end axes at time t, etadd = 0."""
        eta = [a + t * b for a, b in zip(self.eta, self.etad, strict=True)]
        strains = [
            b + sum(row[k] * eta[k] for k in range(N))
            for b, row in zip(self.rest, self.shapes, strict=True)
        ]
        b1, b2, b3 = (_hat(mp.matrix(strains[6 * k : 6 * k + 6])) for k in range(3))
        c1 = -_commutator(b1, b2)
        c2 = _commutator(b1, 2 * b3 + c1) / 60
        omega = b1 + b3 / 12 - _commutator(-20 * b1 - b3 + c1, b2 + c2) / 240
        return mp.expm(omega) * self.end

    def outputs(self) -> dict[str, list[Any]]:
        arithmetic = PreciseArithmetic(DIGITS)
        inputs = {"b": self.rest, "Bm": self.shapes, "eta": self.eta, "etad": self.etad}
        found = replay_kernel(KERNELS["segment"].ir(), inputs, arithmetic, N)
        inputs = {"R_end": self.end[:3, :3].tolist()} | {k: found[k] for k in ("Om", "Omd", "Omdd")}
        return found | replay_kernel(KERNELS["segment_motion"].ir(), inputs, arithmetic, None)


@pytest.mark.parametrize(("seed", "size"), [(1, 0.2), (2, 0.8), (3, 0.0)])
def test_pose_and_rates(seed: int, size: float) -> None:
    with mp.workdps(DIGITS):
        segment = _Segment(seed, mp.mpf(size))
        found = segment.outputs()
        pose = segment.pose(mp.mpf(0))
        rate = mp.matrix(4, 4)
        second = mp.matrix(4, 4)
        for i, j in itertools.product(range(4), repeat=2):
            rate[i, j] = mp.diff(lambda t, i=i, j=j: segment.pose(t)[i, j], 0)
            second[i, j] = mp.diff(lambda t, i=i, j=j: segment.pose(t)[i, j], 0, 2)
        inverse = pose**-1
        twist = inverse * rate
        acceleration = inverse * second - twist * twist
        spin = acceleration[:3, :3]
        linear = (inverse * second)[:3, 3]
        expected = {
            "R": [pose[i, j] for i in range(3) for j in range(3)],
            "d": list(pose[:3, 3]),
            "v": _vee(twist)[:3],
            "w": _vee(twist)[3:],
            "c": [*linear, spin[2, 1], spin[0, 2], spin[1, 0]],
        }
        for name, values in expected.items():
            gap = max(abs(a - b) for a, b in zip(found[name], values, strict=True))
            assert gap < 1e-12, name  # differences, and the series of a, b, c


def test_subspace_is_the_derivative_of_the_pose() -> None:
    with mp.workdps(DIGITS):
        segment = _Segment(5, mp.mpf("0.6"))
        found = segment.outputs()
        h6 = mp.matrix(6, 6)
        for i, j in itertools.product(range(6), repeat=2):
            h6[i, j] = found["H6"][6 * i + j]
        columns = mp.matrix(6, N)
        for i, k in itertools.product(range(6), range(N)):
            columns[i, k] = found["Phi"][N * i + k]
        subspace = h6 * columns
        for k in range(N):
            segment.etad = [mp.mpf(int(i == k)) for i in range(N)]
            rate = mp.matrix(4, 4)
            for i, j in itertools.product(range(4), repeat=2):
                rate[i, j] = mp.diff(lambda t, i=i, j=j: segment.pose(t)[i, j], 0)
            expected = _vee(segment.pose(mp.mpf(0)) ** -1 * rate)
            assert max(abs(subspace[i, k] - expected[i]) for i in range(6)) < 1e-12


def test_pose_converges_with_sixth_order() -> None:
    """Halving a segment of varying curvature divides the error of its pose by about 2^6."""
    root15 = mp.sqrt(15)

    def strain(x: Any) -> Any:
        return mp.matrix([1, 0, 0, mp.sin(x), mp.cos(2 * x), x * x])

    def pose(count: int) -> Any:
        product, h = mp.eye(4), mp.mpf(1) / count
        for k in range(count):
            xi = [strain((k + mp.mpf(1) / 2 + s * root15 / 10) * h) for s in (-1, 0, 1)]
            rest = [*(h * xi[1]), *(root15 / 3 * h * (xi[2] - xi[0])),
                    *(10 * h / 3 * (xi[2] - 2 * xi[1] + xi[0]))]  # fmt: skip
            zeros = [[mp.mpf(0)] * N] * 18
            inputs = {"b": rest, "Bm": zeros, "eta": [0] * N, "etad": [0] * N}
            found = replay_kernel(KERNELS["segment"].ir(), inputs, PreciseArithmetic(DIGITS), N)
            product = product * mp.expm(_hat(mp.matrix(found["Om"])))
        return product

    with mp.workdps(DIGITS):
        reference = pose(32)
        errors = [mp.mnorm(pose(count) - reference, 1) for count in (2, 4, 8)]
    assert all(45 < a / b < 90 for a, b in itertools.pairwise(errors))
