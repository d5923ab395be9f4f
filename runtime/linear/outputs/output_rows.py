"""Linearised quantities, and expressions of them by the chain rule."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from mstmm.errors import SceneError
from mstmm.expression.derivatives import expression_derivatives
from mstmm.expression.expression import Expression, Name

from ..input_channels import Channel


@dataclass(frozen=True)
class Part:
    """Term of a linearised quantity: `factor` times s to the power `order` times a row.

    The row is given by entries (index, value) of `speeds`, or is the effort column of `channel`.
    """

    order: int
    speeds: tuple[tuple[int, float], ...] = ()
    channel: Channel | None = None
    factor: float = 1.0


@dataclass(frozen=True)
class LinearQuantity:
    """Linearised quantity as a sum of `parts`.

    `value` returns its value at the operating point; `feedthrough` lists direct feedthrough as
    (input, factor).
    """

    name: str
    unit: str
    parts: tuple[Part, ...]
    value: Callable[[], float]
    feedthrough: tuple[tuple[str, float], ...] = ()


def formula(
    of: Expression, name: str, unit: str, read: Callable[[Name], LinearQuantity]
) -> LinearQuantity:
    """Linearised expression: its derivatives at the operating point times those of quantities.

    Raises SceneError where the expression is not differentiable there.
    """
    seen = {name: read(name) for name in of.names}
    numbers = {name: quantity.value() for name, quantity in seen.items()}
    parts, through = list[Part](), list[tuple[str, float]]()
    for variable, slope in expression_derivatives(of, numbers.__getitem__).items():
        if not math.isfinite(slope):
            raise SceneError(
                f'"{of.text}" has no finite derivative with respect to {variable.text} at this '
                f"state, {variable.text} = {numbers[variable]:.6g}"
            )
        parts += scale_parts(seen[variable].parts, slope)
        through += [(given, slope * x) for given, x in seen[variable].feedthrough]
    value = of.evaluate(numbers.__getitem__)
    return LinearQuantity(name, unit, tuple(parts), lambda: value, tuple(through))


def scale_parts(parts: Sequence[Part], factor: float) -> Iterator[Part]:
    """Parts multiplied by `factor`."""
    return (replace(part, factor=factor * part.factor) for part in parts)
