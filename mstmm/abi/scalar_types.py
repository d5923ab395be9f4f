"""Scalar types in which any kernel can be compiled and called (`compile_kernel`)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Scalar:
    """Real type: numpy type of its arrays, numbers of that type per value, and roundoff."""

    array: str
    parts: int
    roundoff: float


SCALARS = {
    "float": Scalar("float32", 1, 2.0**-24),
    "double": Scalar("float64", 1, 2.0**-53),
    #: IEEE binary128; values are passed as sums of two doubles, which keep 107 of its 113 bits.
    "quadruple": Scalar("float64", 2, 2.0**-106),
}

#: Name of the function that a library of one kernel exports.
SYMBOL = "mstmm_scalar_call"

#: Compiler flags.  Contraction is off, so that every operation of the IR is rounded.
COMPILER_FLAGS = ("-O2", "-std=gnu17", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")

#: Additional flags by scalar type.
EXTRA_FLAGS = {"quadruple": ("-Wl,--no-as-needed,-lquadmath",)}
