"""Check differentiated kernels against difference quotients in multiple precision."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import mpmath

from mstmm.ir import KernelIR
from mstmm.ir.interpreter import GuardFailure

from .kernel_evaluation import evaluate
from .sample_points import InputSampler

_DIGITS, _STEP = 60, mpmath.mpf(10) ** -20
#: Prefix of derivative ports, and suffix of differentiated kernels.
_PREFIX, _SUFFIX, _RUN_TIME_SIZE = "d_", "_slope", 3


def slope_errors(irs: Mapping[str, KernelIR], source: InputSampler) -> Iterator[tuple[str, float]]:
    """(kernel, largest deviation in units of the largest entry) of every differentiated kernel."""
    for name, kernel in irs.items():
        base = irs.get(name.removesuffix(_SUFFIX))
        if name.endswith(_SUFFIX) and base is not None:
            with mpmath.workdps(_DIGITS):
                yield name, _largest_deviation(kernel, base, source)


def _largest_deviation(kernel: KernelIR, base: KernelIR, source: InputSampler) -> float:
    n = _RUN_TIME_SIZE if kernel.size_symbol else None
    largest = 0.0
    for point in source.points(kernel):
        if not point.label.startswith("random") or (
            kernel.size_symbol and point.n != _RUN_TIME_SIZE
        ):
            continue  # at a special point there may be a kink
        inputs: dict[str, Any] = dict(point.inputs)
        try:
            forward, backward = (
                _evaluate_shifted(base, inputs, side * _STEP, n) for side in (1, -1)
            )
            inputs |= evaluate(base, inputs, _DIGITS, n)  # outputs that later calls read
        except GuardFailure:
            continue
        derivatives = evaluate(kernel, inputs, _DIGITS, n)
        for port, row in derivatives.items():
            base_port = port.removeprefix(_PREFIX)
            pairs = zip(row, forward[base_port], backward[base_port], strict=True)
            gaps = [abs(d - (a - b) / (2 * _STEP)) for d, a, b in pairs]
            size = max([abs(d) for d in row] + [mpmath.mpf(10) ** -10])
            largest = max([largest, *(float(gap / size) for gap in gaps)])
    return largest


def _evaluate_shifted(
    base: KernelIR, inputs: Mapping[str, Any], step: Any, n: int | None
) -> dict[str, Any]:
    """Evaluate the kernel one step along the direction."""
    shifted_inputs = {}
    for port in base.inputs:
        direction = inputs.get(_PREFIX + port.name, [0] * len(inputs[port.name]))
        shifted_inputs[port.name] = [
            mpmath.mpf(x) + step * mpmath.mpf(d)
            for x, d in zip(inputs[port.name], direction, strict=True)
        ]
    return evaluate(base, shifted_inputs, _DIGITS, n)
