"""A quantity as a linear model sees it, and expressions of such by the chain rule."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from mstmm.errors import SceneError
from mstmm.expression.derivative import expression_derivatives
from mstmm.expression.expression import Expression, Name

from ..input_channels import Channel


@dataclass(frozen=True)
class Part:
    """`factor` times a power `order` of s times a row: of speeds (place, number), or of how far
    `push` reaches."""

    order: int
    speeds: tuple[tuple[int, float], ...] = ()
    push: Channel | None = None
    factor: float = 1.0


@dataclass(frozen=True)
class LinearQuantity:
    """A quantity: its name, unit and parts; `value` gives its number at the state, `through` what
    of an input it has at once."""

    name: str
    unit: str
    parts: tuple[Part, ...]
    value: Callable[[], float]
    through: tuple[tuple[str, float], ...] = ()


def formula(
    of: Expression, name: str, unit: str, read: Callable[[Name], LinearQuantity]
) -> LinearQuantity:
    """An expression of quantities: its slopes at the state times what each of them does.

    Raises SceneError where it has no slope there.
    """
    seen = {one: read(one) for one in of.names}
    numbers = {one: quantity.value() for one, quantity in seen.items()}
    parts, through = list[Part](), list[tuple[str, float]]()
    for one, slope in expression_derivatives(of, numbers.__getitem__).items():
        if not math.isfinite(slope):
            raise SceneError(
                f'"{of.text}" has no slope by {one.text} at the state, where that is '
                f"{numbers[one]:.6g}"
            )
        parts += scaled(seen[one].parts, slope)
        through += [(given, slope * x) for given, x in seen[one].through]
    value = of.evaluate(numbers.__getitem__)
    return LinearQuantity(name, unit, tuple(parts), lambda: value, tuple(through))


def scaled(parts: Sequence[Part], factor: float) -> Iterator[Part]:
    """Parts, so many times."""
    return (replace(part, factor=factor * part.factor) for part in parts)
