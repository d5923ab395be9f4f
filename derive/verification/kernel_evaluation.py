"""Evaluation of a KernelIR at any precision (mpmath); `mstmm.ir.interpreter` uses floats.

Both execute the same statements in the same order; only the arithmetic differs.  Operations outside
their real domain give NaN or infinity as in IEEE arithmetic, never an exception.
"""

from __future__ import annotations

from collections.abc import Mapping

import mpmath

from mstmm.ir import KernelIR
from mstmm.ir.interpreter import Values, replay_kernel

from .mpmath_arithmetic import PreciseArithmetic


def evaluate(
    kernel: KernelIR, inputs: Mapping[str, Values], digits: int = 50, n: int | None = None
) -> dict[str, list[mpmath.mpf]]:
    """Outputs of the kernel at `digits` decimal digits, each a flat list, row-major.

    `inputs[port]` is a number or a nested or flat sequence of int, float, Fraction, str or mpf;
    floats count as exact numbers.  `n` is the run-time size of a kernel that has
    one.  An output flagged `accumulate` holds the increment; an entry that is never stored is 0.
    Values without a port of that name are ignored.
    Raises GuardFailure, and ValueError for a missing input, a wrong length or no `n`.
    """
    arithmetic = PreciseArithmetic(digits)
    results = replay_kernel(kernel, inputs, arithmetic, n)
    return {name: [mpmath.mp.make_mpf(v._mpf_) for v in row] for name, row in results.items()}
