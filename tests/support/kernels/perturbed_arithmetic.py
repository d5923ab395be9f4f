"""Kernels on numbers that every operation shakes: how far rounding carries through a computation.

Inputs alone tell too little: moments carried about a far point and back are rounded on the way.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from numpy.random import Generator

from mstmm.ir import OPERATIONS, Constant, KernelIR
from mstmm.ir.interpreter import DoubleArithmetic, replay_kernel

#: Relative size of the shaking; far above rounding, far below where the outputs bend.
STEP = 1e-8


class ShakenArithmetic(DoubleArithmetic):
    """Doubles of which every input and every result is moved by up to STEP, at random."""

    def __init__(self, rng: Generator) -> None:
        self._rng = rng
        self.operations = {  # type: ignore[misc]
            name: row.value if row.truth else self._perturb_operation(row.value)
            for name, row in OPERATIONS.items()
        }

    def _perturb_operation(self, operation: Callable[..., float]) -> Callable[..., float]:
        return lambda *args: operation(*args) * (1 + STEP * self._rng.uniform(-1, 1))

    def number(self, value: Any) -> float:
        return float(value) * (1 + STEP * self._rng.uniform(-1, 1))

    def constant(self, constant: Constant) -> float:
        return constant.number


def perturbed_outputs(
    kernel: KernelIR, inputs: Mapping[str, Any], rng: Generator
) -> dict[str, list[float]]:
    """The kernel's outputs from shaken inputs by shaken operations."""
    return replay_kernel(kernel, inputs, ShakenArithmetic(rng), None)
