"""Check differentiated kernels against difference quotients in multiple precision."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import mpmath

from mstmm.ir import KernelIR
from mstmm.ir.replay import GuardFailure

from .evaluate import evaluate
from .samples import Source

_DIGITS, _STEP = 60, mpmath.mpf(10) ** -20
#: Prefix of derivative ports, and suffix of differentiated kernels.
_PREFIX, _SUFFIX, _SIZE = "d_", "_slope", 3


def slope_errors(irs: Mapping[str, KernelIR], source: Source) -> Iterator[tuple[str, float]]:
    """(kernel, largest deviation in units of the largest entry) of every differentiated kernel."""
    for name, kernel in irs.items():
        base = irs.get(name.removesuffix(_SUFFIX))
        if name.endswith(_SUFFIX) and base is not None:
            with mpmath.workdps(_DIGITS):
                yield name, _error(kernel, base, source)


def _error(kernel: KernelIR, base: KernelIR, source: Source) -> float:
    n = _SIZE if kernel.size_symbol else None
    worst = 0.0
    for point in source.points(kernel):
        if not point.label.startswith("random") or (kernel.size_symbol and point.n != _SIZE):
            continue  # at a special point there may be a kink
        inputs: dict[str, Any] = dict(point.inputs)
        try:
            ahead, behind = (_moved(base, inputs, side * _STEP, n) for side in (1, -1))
            inputs |= evaluate(base, inputs, _DIGITS, n)  # outputs that are read again
        except GuardFailure:
            continue
        found = evaluate(kernel, inputs, _DIGITS, n)
        for port, row in found.items():
            whole = port.removeprefix(_PREFIX)
            pairs = zip(row, ahead[whole], behind[whole], strict=True)
            gaps = [abs(d - (a - b) / (2 * _STEP)) for d, a, b in pairs]
            size = max([abs(d) for d in row] + [mpmath.mpf(10) ** -10])
            worst = max([worst, *(float(gap / size) for gap in gaps)])
    return worst


def _moved(base: KernelIR, inputs: Mapping[str, Any], step: Any, n: int | None) -> dict[str, Any]:
    """Evaluate the kernel one step along the direction."""
    moved = {}
    for port in base.inputs:
        ways = inputs.get(_PREFIX + port.name, [0] * len(inputs[port.name]))
        moved[port.name] = [
            mpmath.mpf(x) + step * mpmath.mpf(d)
            for x, d in zip(inputs[port.name], ways, strict=True)
        ]
    return evaluate(base, moved, _DIGITS, n)
