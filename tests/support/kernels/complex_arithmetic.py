"""Kernels on complex numbers: the complex step, a derivative without a difference.

Comparisons and kinks go by the real part, so that each branch is differentiated as it is taken.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from mstmm.ir import OPERATIONS, Constant, KernelIR
from mstmm.ir.interpreter import replay_kernel

STEP = 1e-200


def _angle(y: complex, x: complex) -> complex:
    """atan2 of nearly real numbers: its value and its exact slope times the small part."""
    real = OPERATIONS["atan2"].value(y.real, x.real)
    turning = y.imag * x.real - y.real * x.imag
    return complex(real, turning / (x.real**2 + y.real**2) if turning else 0.0)


def _real_part_operation(name: str) -> Callable[..., complex]:
    """An operation that only looks at real parts."""
    operation = OPERATIONS[name].value
    return lambda *args: complex(operation(*(a.real for a in args)))


def _power(a: complex, b: complex) -> complex:
    """a^b; a whole exponent of a negative base has no imaginary part of its own."""
    if b.imag == 0:
        value = OPERATIONS["pow"].value(a.real, b.real)
        slope = b.real * OPERATIONS["pow"].value(a.real, b.real - 1)
        return complex(value, slope * a.imag)
    return a**b


class ComplexArithmetic:
    """What `mstmm.derive.verification.kernel_evaluation.replay_kernel` needs."""

    operations: ClassVar[Mapping[str, Callable[..., Any]]] = {
        **{name: getattr(cmath, name) for name in (
            "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp",
            "log",
        )},
        **{name: _real_part_operation(name) for name in (
            "sign", "floor", "lt", "le", "eq", "and", "or", "not",
        )},
        "neg": lambda a: -a,
        "add": lambda a, b: a + b,
        "sub": lambda a, b: a - b,
        "mul": lambda a, b: a * b,
        "div": lambda a, b: a / b,
        "pow": _power,
        "atan2": _angle,
        "abs": lambda a: a if a.real >= 0 else -a,
        "min": lambda a, b: a if a.real < b.real else b,
        "max": lambda a, b: b if a.real < b.real else a,
        "select": lambda c, a, b: a if c.real != 0 else b,
    }  # fmt: skip

    def number(self, value: Any) -> complex:
        return complex(value)

    def constant(self, constant: Constant) -> complex:
        return complex(constant.number)

    def true(self, value: complex) -> bool:
        return value.real != 0


def complex_step(
    kernel: KernelIR, inputs: Mapping[str, Any], directions: Mapping[str, Any]
) -> dict[str, list[float]]:
    """Derivatives of the outputs along `directions`, given for some of the input ports."""
    moved = {
        name: [
            complex(x, STEP * d)
            for x, d in zip(values, directions.get(name, [0.0] * len(values)), strict=True)
        ]
        for name, values in inputs.items()
    }
    found = replay_kernel(kernel, moved, ComplexArithmetic(), None)
    return {name: [y.imag / STEP for y in row] for name, row in found.items()}
