"""Panels of curves as arrays with labels: what a picture and a page draw alike."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mstmm.arguments import word_of
from mstmm.arrays import Array
from mstmm.errors import SceneError

from ...engine.shown import rate_unit
from ..names import Quantity, columns
from .choice import Chosen, choose
from .curves import curve
from .shown import Shown
from .spectra import spectrum
from .titles import noun, with_unit

#: What is drawn: over time or another quantity, the rate over the quantity, or over frequency.
KINDS = ("time", "phase", "spectrum")

#: A panel shows at least this part of its largest value.
_FLAT = 1e-3


@dataclass(frozen=True)
class Trace:
    """A curve through x, y (n,); `colour` and `style` are numbers from 0 on that tell it apart.

    `low` and `high` (n,) are the edges of a band around it, None where there is none.  Where curves
    of several runs stand for several columns, `column` and `run` say which.
    """

    label: str
    x: Array
    y: Array
    colour: int
    style: int = 0
    low: Array | None = None
    high: Array | None = None
    column: str = ""
    run: str = ""


@dataclass(frozen=True)
class Panel:
    """Curves of one unit with a title; `more` says what was left out, `names` what is in it, and
    `notes` are sentences on what to know.

    `x` says what lies along the other axis, which panels over "time" share.
    """

    title: str
    x: str
    kind: str
    names: tuple[str, ...]
    traces: tuple[Trace, ...]
    more: str = ""
    alike: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Wanted:
    """What to draw: names, none for a choice; over which other quantity; a kind of KINDS."""

    names: tuple[str, ...] = ()
    against: str | None = None
    kind: str = "time"

    def __post_init__(self) -> None:
        for name in (*self.names, *(() if self.against is None else (self.against,))):
            if not isinstance(name, str):
                raise SceneError(
                    f'plot: expected the name of a quantity, such as "energy", found {name!r:.60}; '
                    "of several names each is an argument of its own"
                )
        known = f"one of {', '.join(KINDS)}"
        if word_of("kind", self.kind, known) not in KINDS:
            raise SceneError(f"kind = {self.kind!r}: expected {known}")
        if self.against is not None and self.kind != "time":
            raise SceneError(
                f'against = "{self.against}" beside kind = "{self.kind}": take one of them'
            )


def panels(runs: Mapping[str, Shown], wanted: Wanted) -> list[Panel]:
    """One for each unit, in the order of the names; curves of all runs, by their labels.

    SceneError for a name that no run has, and for what cannot be drawn of a quantity.
    """
    first = next(iter(runs.values()))
    groups = _named(runs, wanted.names) if wanted.names else choose(first)
    return [_panel(runs, group, wanted) for group in groups]


def _named(runs: Mapping[str, Shown], names: Sequence[str]) -> list[Chosen]:
    """The names by their units; of several names of one quantity the first."""
    units: dict[str, dict[str, str]] = {}
    for name in names:
        found = _first(runs, name)
        units.setdefault(found.unit, {}).setdefault(found.name, name)
    return [Chosen(tuple(some.values()), unit) for unit, some in units.items()]


def _first(runs: Mapping[str, Shown], name: str) -> Quantity:
    """Of the first run that has it; what the first one says where none has."""
    refused: SceneError | None = None
    for run in runs.values():
        try:
            return run.quantity(name)
        except SceneError as error:
            refused = refused or error
    assert refused is not None
    raise refused


def _panel(runs: Mapping[str, Shown], group: Chosen, wanted: Wanted) -> Panel:
    quantities = [_first(runs, name) for name in group.names]
    labels = [label for one in quantities for label in columns(one)]
    alone = len(labels) == 1
    traces, lacking = [], []
    for number, (run_label, run) in enumerate(runs.items()):
        for name, place in zip(group.names, _places(quantities), strict=True):
            try:
                quantity = run.quantity(name)
            except SceneError:
                lacking.append(f"{run_label} has no {name}")
                continue
            for k, (x, y) in enumerate(_drawn(run, quantity, wanted)):
                column = labels[place + k]
                if len(runs) == 1:
                    trace = Trace(column, x, y, number if alone else place + k)
                elif alone:
                    trace = Trace(run_label, x, y, number)
                else:
                    whole = f"{column}, {run_label}"
                    trace = Trace(whole, x, y, place + k, number, column=column, run=run_label)
                traces.append(trace)
    more = "; ".join(filter(None, (group.more, *lacking)))
    title, below, alike = _titles(quantities, runs, wanted)
    notes = (group.sentence, *lacking, *(f"{x.name}: {x.note}" for x in quantities if x.note))
    return Panel(
        title, below, wanted.kind if wanted.against is None else "against", group.names,
        tuple(traces), more, alike, tuple(dict.fromkeys(filter(None, notes))),
    )  # fmt: skip


def steady(panel: Panel) -> tuple[float, float] | None:
    """Where the axis of a panel of constants ends, which shows them as lines, not their last digits
    as mountains; None for all others."""
    values = np.concatenate([trace.y for trace in panel.traces])
    values = values[np.isfinite(values)]
    if not len(values):
        return None
    low, high = float(values.min()), float(values.max())
    least = _FLAT * max(abs(low), abs(high))
    if high - low >= least:
        return None
    middle = (low + high) / 2
    return middle - least / 2, middle + least / 2


def _places(quantities: Sequence[Quantity]) -> list[int]:
    """Number of the first column of each."""
    counts = [len(columns(one)) for one in quantities]
    return [sum(counts[:k]) for k in range(len(counts))]


def _titles(
    quantities: Sequence[Quantity], runs: Mapping[str, Shown], wanted: Wanted
) -> tuple[str, str, bool]:
    """Title, what lies along x, and whether both are lengths."""
    what, unit = noun(quantities), quantities[0].unit
    if wanted.against is not None:
        other = _scalar(_first(runs, wanted.against))
        below = with_unit(noun([other]), other.unit)
        return with_unit(what, unit), below, unit == other.unit == "m"
    if wanted.kind == "phase":
        return with_unit(f"rate of {what}", rate_unit(unit)), with_unit(what, unit), False
    if wanted.kind == "spectrum":
        return with_unit(f"amplitude of {what}", unit), "frequency (Hz)", False
    return with_unit(what, unit), "time (s)", False


def _drawn(run: Shown, quantity: Quantity, wanted: Wanted) -> Iterator[tuple[Array, Array]]:
    """x and y of every column."""
    if wanted.kind == "spectrum":
        frequencies, amplitudes = spectrum(run.t, quantity)
        yield from ((frequencies, column) for column in amplitudes.T)
        return
    t, values = curve(run.t, quantity)
    if wanted.kind == "phase":
        _, rates = curve(run.t, _rate(quantity))
        yield from zip(values.T, rates.T, strict=True)
        return
    if wanted.against is not None:
        _, across = curve(run.t, _scalar(run.quantity(wanted.against)))
        t = across[:, 0]
    yield from ((t, column) for column in values.T)


def _rate(quantity: Quantity) -> Quantity:
    """Its time derivative; SceneError where that is no quantity."""
    rates: Callable[[], Array] | None = quantity.rates
    if rates is None:
        raise SceneError(
            f'"{quantity.name}": its rate is not known, so it has no phase picture; draw it '
            "against another quantity"
        )
    return replace(quantity, values=np.asarray(rates()), rates=None)


def _scalar(quantity: Quantity) -> Quantity:
    if quantity.labels:
        raise SceneError(
            f'against "{quantity.name}": it has {len(quantity.labels)} components; take one, such '
            f"as {quantity.name}.{quantity.labels[0]}"
        )
    return quantity
