"""Panels of curves as arrays with labels, shared by figures and pages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mstmm.argument_validation import require_word
from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ...engine.observation_columns import rate_unit
from ..quantity_names import Quantity, column_labels
from .curve_interpolation import curve
from .default_quantities import DefaultPanel, choose_panels
from .plot_sources import PlotSource
from .spectra import spectrum
from .titles import common_noun, with_unit

#: Kinds of plots: over time or another quantity, rate over quantity, or over frequency.
PLOT_KINDS = ("time", "phase", "spectrum")

#: A panel spans at least this part of its largest value.
_MIN_SPAN_RATIO = 1e-3


@dataclass(frozen=True)
class Trace:
    """Curve through x, y (n,); `colour` and `style` are indices from 0 that distinguish it.

    `low` and `high` (n,) are the edges of a band around it, None if there is none. Where curves
    belong to several runs and several columns, `column` and `run` identify them.
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
    """Curves of one unit with a title.

    `more` describes what was left out, `names` lists the contents, and `notes` are sentences for
    readers. `x` describes the other axis, which panels over "time" share.
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
class PlotSelection:
    """Selection of a plot: names (defaults if empty), `against` quantity, one of `PLOT_KINDS`."""

    names: tuple[str, ...] = ()
    against: str | None = None
    kind: str = "time"

    def __post_init__(self) -> None:
        for name in (*self.names, *(() if self.against is None else (self.against,))):
            if not isinstance(name, str):
                raise SceneError(
                    f'plot: expected the name of a quantity, such as "energy", found {name!r:.60}; '
                    "give several names as separate arguments"
                )
        expected = f"one of {', '.join(PLOT_KINDS)}"
        if require_word("kind", self.kind, expected) not in PLOT_KINDS:
            raise SceneError(f"kind = {self.kind!r}: expected {expected}")
        if self.against is not None and self.kind != "time":
            raise SceneError(
                f'against = "{self.against}" and kind = "{self.kind}": give only one of them'
            )


def build_panels(runs: Mapping[str, PlotSource], selection: PlotSelection) -> list[Panel]:
    """Build one panel per unit in the order of the names, with the curves of all runs by label.

    SceneError for a name that no run has, and for what cannot be drawn of a quantity.
    """
    first = next(iter(runs.values()))
    groups = _named_panels(runs, selection.names) if selection.names else choose_panels(first)
    return [_build_panel(runs, group, selection) for group in groups]


def _named_panels(runs: Mapping[str, PlotSource], names: Sequence[str]) -> list[DefaultPanel]:
    """Names grouped by unit; of several names of one quantity the first."""
    units: dict[str, dict[str, str]] = {}
    for name in names:
        quantity = _first_quantity(runs, name)
        units.setdefault(quantity.unit, {}).setdefault(quantity.name, name)
    return [
        DefaultPanel(tuple(names_by_quantity.values()), unit)
        for unit, names_by_quantity in units.items()
    ]


def _first_quantity(runs: Mapping[str, PlotSource], name: str) -> Quantity:
    """Quantity of the first run that has it; the error of the first run if none has."""
    first_error: SceneError | None = None
    for run in runs.values():
        try:
            return run.quantity(name)
        except SceneError as error:
            first_error = first_error or error
    assert first_error is not None
    raise first_error


def _build_panel(
    runs: Mapping[str, PlotSource], group: DefaultPanel, selection: PlotSelection
) -> Panel:
    quantities = [_first_quantity(runs, name) for name in group.names]
    labels = [label for quantity in quantities for label in column_labels(quantity)]
    is_single = len(labels) == 1
    traces, missing_notes = [], []
    for number, (run_label, run) in enumerate(runs.items()):
        for name, first_column in zip(group.names, _first_columns(quantities), strict=True):
            try:
                quantity = run.quantity(name)
            except SceneError:
                missing_notes.append(f"{run_label} has no {name}")
                continue
            for k, (x, y) in enumerate(_drawn_curves(run, quantity, selection)):
                column = labels[first_column + k]
                if len(runs) == 1:
                    trace = Trace(column, x, y, number if is_single else first_column + k)
                elif is_single:
                    trace = Trace(run_label, x, y, number)
                else:
                    full_label = f"{column}, {run_label}"
                    trace = Trace(
                        full_label, x, y, first_column + k, number, column=column, run=run_label
                    )
                traces.append(trace)
    more = "; ".join(filter(None, (group.more, *missing_notes)))
    title, x_label, has_equal_scales = _panel_titles(quantities, runs, selection)
    notes = (group.sentence, *missing_notes, *(f"{x.name}: {x.note}" for x in quantities if x.note))
    return Panel(
        title, x_label, selection.kind if selection.against is None else "against", group.names,
        tuple(traces), more, has_equal_scales, tuple(dict.fromkeys(filter(None, notes))),
    )  # fmt: skip


def constant_axis_limits(panel: Panel) -> tuple[float, float] | None:
    """Axis limits of a panel of constants, None for all others.

    Constants are shown as lines, without magnified rounding.
    """
    values = np.concatenate([trace.y for trace in panel.traces])
    values = values[np.isfinite(values)]
    if not len(values):
        return None
    low, high = float(values.min()), float(values.max())
    min_span = _MIN_SPAN_RATIO * max(abs(low), abs(high))
    if high - low >= min_span:
        return None
    middle = (low + high) / 2
    return middle - min_span / 2, middle + min_span / 2


def _first_columns(quantities: Sequence[Quantity]) -> list[int]:
    """Index of the first column of each quantity."""
    counts = [len(column_labels(quantity)) for quantity in quantities]
    return [sum(counts[:k]) for k in range(len(counts))]


def _panel_titles(
    quantities: Sequence[Quantity], runs: Mapping[str, PlotSource], selection: PlotSelection
) -> tuple[str, str, bool]:
    """Title, label of the x axis, and whether both axes are lengths."""
    text, unit = common_noun(quantities), quantities[0].unit
    if selection.against is not None:
        abscissa = _require_scalar(_first_quantity(runs, selection.against))
        x_label = with_unit(common_noun([abscissa]), abscissa.unit)
        return with_unit(text, unit), x_label, unit == abscissa.unit == "m"
    if selection.kind == "phase":
        return with_unit(f"rate of {text}", rate_unit(unit)), with_unit(text, unit), False
    if selection.kind == "spectrum":
        return with_unit(f"amplitude of {text}", unit), "frequency (Hz)", False
    return with_unit(text, unit), "time (s)", False


def _drawn_curves(
    run: PlotSource, quantity: Quantity, selection: PlotSelection
) -> Iterator[tuple[Array, Array]]:
    """Curves (x, y) of every column."""
    if selection.kind == "spectrum":
        frequencies, amplitudes = spectrum(run.t, quantity)
        yield from ((frequencies, column) for column in amplitudes.T)
        return
    t, values = curve(run.t, quantity)
    if selection.kind == "phase":
        _, rates = curve(run.t, _rate_quantity(quantity))
        yield from zip(values.T, rates.T, strict=True)
        return
    if selection.against is not None:
        _, abscissa = curve(run.t, _require_scalar(run.quantity(selection.against)))
        t = abscissa[:, 0]
    yield from ((t, column) for column in values.T)


def _rate_quantity(quantity: Quantity) -> Quantity:
    """Time derivative of a quantity; SceneError if it is not a quantity."""
    rates: Callable[[], Array] | None = quantity.rates
    if rates is None:
        raise SceneError(
            f'"{quantity.name}": a phase plot needs its rate, which is not available; plot '
            "it against another quantity"
        )
    return replace(quantity, values=np.asarray(rates()), rates=None)


def _require_scalar(quantity: Quantity) -> Quantity:
    if quantity.labels:
        raise SceneError(
            f'against "{quantity.name}": it has {len(quantity.labels)} components; give one, such '
            f"as {quantity.name}.{quantity.labels[0]}"
        )
    return quantity
