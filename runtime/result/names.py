"""A quantity of a run, and the names under which the quantities of one owner are found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from mstmm.arrays import Array

from ..engine.shown import Kind

Values = Callable[[], Array]


@dataclass(frozen=True)
class Quantity:
    """Values (n,) or (n, k) over time; `labels` has one entry per column.

    `rates` are their time derivatives where these are quantities themselves.
    """

    name: str
    values: Array
    unit: str
    long_name: str
    labels: tuple[str, ...] = ()
    rates: Callable[[], Array] | None = field(default=None, compare=False)


@dataclass
class Table:
    """Names of one owner: how to get each quantity, and one name for every number."""

    entries: dict[str, Callable[[], Quantity]]
    scalars: list[str]

    def scalar(
        self, name: str, unit: str, long_name: str, get: Values, k: int | None = None,
        rates: Values | None = None, listed: bool = True,
    ) -> None:  # fmt: skip
        """One number, column k of what `get` gives."""
        slope = None if rates is None else (lambda: _pick(rates(), k))
        self.entries[name] = lambda: Quantity(name, _pick(get(), k), unit, long_name, rates=slope)
        if listed:
            self.scalars.append(name)

    def vector(
        self, name: str, owner: str, about: Kind, get: Values, rates: Values | None = None,
        listed: bool = True,
    ) -> None:  # fmt: skip
        """The vector under its name, each component under name.x, and short as in rod1.tip.vx.

        What is not `listed` has names but no column in a wide table.
        """
        long_name = f"{about.long_name} of {owner}"
        self.entries[name] = lambda: Quantity(
            name, get(), about.unit, long_name, about.labels, rates
        )
        for k, label in enumerate(about.labels):
            text = f"{long_name}, {label}"
            short = f"{owner}.{about.short[k]}" if about.short else ""
            taken = not short or short in self.entries
            self.scalar(f"{name}.{label}", about.unit, text, get, k, rates, listed and taken)
            if not taken:
                self.scalar(short, about.unit, text, get, k, rates, listed)


def _pick(values: Array, k: int | None) -> Array:
    return values if k is None else values[:, k]
