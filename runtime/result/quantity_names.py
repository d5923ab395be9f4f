"""Quantity of a run, and the name table of the quantities of one owner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from mstmm.array_validation import Array

from ..engine.quantity_registry import QuantityKind

Values = Callable[[], Array]


@dataclass(frozen=True)
class Quantity:
    """Values (n,) or (n, k) over time; `labels` has one entry per column.

    `rates` are their time derivatives if these are also quantities. `description` is the noun of an
    `owner`: "angle" of "hinge elbow"; "" without an owner. `note` is a sentence for readers.
    """

    name: str
    values: Array
    unit: str
    long_name: str
    labels: tuple[str, ...] = ()
    rates: Callable[[], Array] | None = field(default=None, compare=False)
    description: str = ""
    owner: str = ""
    note: str = ""


def column_labels(quantity: Quantity) -> list[str]:
    """Labels of the columns of a quantity."""
    return [f"{quantity.name}.{label}" for label in quantity.labels] or [quantity.name]


@dataclass
class Table:
    """Names of one owner: getters, names of all scalar columns, and undivided vectors.

    Files hold the `vector_names` quantities, with vectors undivided. Of equal names the first one
    counts.
    """

    entries: dict[str, Callable[[], Quantity]]
    scalars: list[str]
    vector_names: list[str] = field(default_factory=list)

    def scalar(
        self, name: str, unit: str, what: str, get: Values, k: int | None = None,
        rates: Values | None = None, listed: bool = True, owner: str = "",
    ) -> None:  # fmt: skip
        """Add a scalar quantity: column k of the values that `get` returns."""
        long_name = f"{what} of {owner}" if owner else what
        if name not in self.entries and listed:
            self.vector_names.append(name)
        self._add_entry(name, unit, long_name, get, k, rates, listed, what, owner)

    def vector(
        self, name: str, owner: str, about: QuantityKind, get: Values, rates: Values | None = None,
        listed: bool = True, note: Callable[[Array], str] | None = None, base: str = "",
    ) -> None:  # fmt: skip
        """Add a vector under its name, each component under name.x, and a short name (rod1.tip.vx).

        `base` is the prefix of names if the owner has another name than "hinge shoulder". If not
        `listed`, it has names but no column in a wide table. `note` returns a sentence on the
        values.
        """
        what, long_name = about.long_name, f"{about.long_name} of {owner}"

        def make_vector() -> Quantity:
            values = get()
            note_text = "" if note is None else note(values)
            return Quantity(
                name, values, about.unit, long_name, about.labels, rates, what, owner, note_text
            )

        if name not in self.entries and listed:
            self.vector_names.append(name)
        self.entries.setdefault(name, make_vector)
        for k, label in enumerate(about.labels):
            text = f"{long_name}, {label}"
            short_name = f"{base or owner}.{about.short[k]}" if about.short else ""
            has_free_short_name = bool(short_name) and short_name not in self.entries
            full_name = f"{name}.{label}"
            self._add_entry(
                full_name,
                about.unit,
                text,
                get,
                k,
                rates,
                listed and not has_free_short_name,
                what,
                owner,
                note,
            )
            if has_free_short_name:
                self._add_entry(
                    short_name, about.unit, text, get, k, rates, listed, what, owner, note
                )

    def _add_entry(
        self, name: str, unit: str, long_name: str, get: Values, k: int | None,
        rates: Values | None, listed: bool, what: str, owner: str,
        note: Callable[[Array], str] | None = None,
    ) -> None:  # fmt: skip
        rate_values = None if rates is None else (lambda: _select_column(rates(), k))

        def make_component() -> Quantity:
            values = get()
            note_text = "" if note is None else note(values)
            return Quantity(
                name,
                _select_column(values, k),
                unit,
                long_name,
                (),
                rate_values,
                what,
                owner,
                note_text,
            )

        if name not in self.entries and listed:
            self.scalars.append(name)
        self.entries.setdefault(name, make_component)


def _select_column(values: Array, k: int | None) -> Array:
    return values if k is None else values[:, k]
