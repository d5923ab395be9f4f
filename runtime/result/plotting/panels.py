"""Panels of curves as arrays with labels, shared by figures and pages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mstmm.argument_validation import require_word
from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ...engine.quantity_registry import rate_unit
from ..quantity_names import Quantity, column_labels
from .default_quantities import DefaultPanel, PlotSource, choose_panels

# --- curves through the samples -------------------------------------------------------------------

#: Runs with at least this many samples are drawn unchanged; others are refined to this many.
MIN_DRAWN_POINTS = 600


def curve(t: Array, quantity: Quantity) -> tuple[Array, Array]:
    """Times (m,) and values (m, k) to draw; nan between two samples at one time (an event).

    Between samples: the cubic through values and rates where the rate is known, else Akima's
    modified interpolant, which does not overshoot at corners (H. Akima, J. ACM 17 (1970) 589-602).
    """
    values = quantity.values.reshape(len(t), -1)
    rates = None if quantity.rates is None else quantity.rates().reshape(len(t), -1)
    times, value_pieces = list[Array](), list[Array]()
    for piece in np.split(np.arange(len(t)), np.flatnonzero(np.diff(t) == 0) + 1):
        x, y = t[piece], values[piece]
        if len(t) < MIN_DRAWN_POINTS and len(piece) > 1 and np.isfinite(y).all():
            x = refine_times(x, MIN_DRAWN_POINTS / max(t[-1] - t[0], 1e-300))
            y = interpolate(t[piece], y, None if rates is None else rates[piece], x)
        times += [x, np.array([np.nan])]
        value_pieces += [y, np.full((1, values.shape[1]), np.nan)]
    return np.concatenate(times[:-1]), np.concatenate(value_pieces[:-1])


def refine_times(t: Array, density: float) -> Array:
    """Times with evenly spaced ones added between them, `density` per second or more."""
    parts = [
        np.linspace(a, b, max(2, int((b - a) * density) + 1), endpoint=False)
        for a, b in pairwise(t)
    ]
    return np.concatenate([*parts, t[-1:]])


def interpolate(t: Array, values: Array, rates: Array | None, x: Array) -> Array:
    """Values (m, k) at the times x between those at t (n,): see `curve`."""
    from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline

    if rates is not None and np.isfinite(rates).all():
        return np.asarray(CubicHermiteSpline(t, values, rates)(x))
    if len(t) < 3:
        return np.stack([np.interp(x, t, column) for column in values.T], axis=1)
    return np.asarray(Akima1DInterpolator(t, values, method="makima")(x))


# --- spectra --------------------------------------------------------------------------------------

#: Least number of samples for a spectrum, and largest number used.
_MIN_SAMPLES, _MAX_SAMPLES = 16, 2**16

#: Factor of refinement relative to frequencies spaced by one over the run, to locate peaks.
_FREQUENCY_REFINEMENT = 4


def spectrum(t: Array, quantity: Quantity) -> tuple[Array, Array]:
    """Frequencies (m,) in Hz and amplitudes (m, k) in the quantity's unit.

    A sine of amplitude a that lasts for many periods appears as a peak of height a: the mean is
    subtracted, and Hann's window is applied and normalised by its own mean (SciPy's periodogram,
    scaling "spectrum"). Samples that are not evenly spaced are interpolated on the curve through
    them at the same number of even times; frequencies end at two samples per period.

    Raises SceneError for too few samples and for values that are not finite.
    """
    from scipy.signal import periodogram

    t, unique_indices = np.unique(t, return_index=True)
    values = quantity.values.reshape(len(quantity.values), -1)[unique_indices]
    if len(t) < _MIN_SAMPLES:
        raise SceneError(
            f'"{quantity.name}": a spectrum needs {_MIN_SAMPLES} samples or more, there are '
            f"{len(t)}; give more output times"
        )
    if not np.isfinite(values).all():
        raise SceneError(f'"{quantity.name}": some values are not finite, so it has no spectrum')
    even_times = np.linspace(t[0], t[-1], min(len(t), _MAX_SAMPLES))
    if not np.allclose(t, even_times, rtol=0, atol=1e-6 * (even_times[1] - even_times[0])):
        rates = (
            None if quantity.rates is None else quantity.rates().reshape(len(quantity.values), -1)
        )
        values = interpolate(
            t, values, None if rates is None else rates[unique_indices], even_times
        )
    rate, points = 1 / (even_times[1] - even_times[0]), _FREQUENCY_REFINEMENT * len(even_times)
    frequencies, powers = periodogram(
        values, rate, "hann", points, "constant", scaling="spectrum", axis=0
    )
    return frequencies, np.sqrt(2 * powers)


# --- panels ---------------------------------------------------------------------------------------

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
    labels: list[str] = []
    first_columns: list[int] = []
    for quantity in quantities:
        first_columns.append(len(labels))
        labels += column_labels(quantity)
    is_single = len(labels) == 1
    traces, missing_notes = [], []
    for number, (run_label, run) in enumerate(runs.items()):
        for name, first_column in zip(group.names, first_columns, strict=True):
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


# --- titles ---------------------------------------------------------------------------------------

#: Nouns of quantities that share only a unit.
_NOUN_BY_UNIT = {
    "rad": "angles", "m": "lengths", "rad/s": "angular velocities", "m/s": "velocities",
    "rad/s2": "angular accelerations", "m/s2": "accelerations", "N": "forces", "N*m": "moments",
    "J": "energies", "W": "powers", "kg*m/s": "momenta", "kg*m2/s": "angular momenta",
    "": "numbers",
}  # fmt: skip

_UNIT_TEXT = {
    "N*m": "N m",
    "m/s2": "m/s²",
    "rad/s2": "rad/s²",
    "kg*m/s": "kg m/s",
    "kg*m2/s": "kg m²/s",
}

#: Largest number of owners that are named individually.
_MAX_NAMED_OWNERS = 3


def _panel_titles(
    quantities: Sequence[Quantity], runs: Mapping[str, PlotSource], selection: PlotSelection
) -> tuple[str, str, bool]:
    """Title, label of the x axis, and whether both axes are lengths."""
    text, unit = _common_noun(quantities), quantities[0].unit
    if selection.against is not None:
        abscissa = _require_scalar(_first_quantity(runs, selection.against))
        x_label = _with_unit(_common_noun([abscissa]), abscissa.unit)
        return _with_unit(text, unit), x_label, unit == abscissa.unit == "m"
    if selection.kind == "phase":
        return _with_unit(f"rate of {text}", rate_unit(unit)), _with_unit(text, unit), False
    if selection.kind == "spectrum":
        return _with_unit(f"amplitude of {text}", unit), "frequency (Hz)", False
    return _with_unit(text, unit), "time (s)", False


def _with_unit(text: str, unit: str) -> str:
    """Text with its unit: angle of hinge elbow (rad)."""
    unit_text = _UNIT_TEXT.get(unit, unit)
    return f"{text} ({unit_text})" if unit_text else text


def _common_noun(quantities: Sequence[Quantity]) -> str:
    """Common noun of quantities of one unit.

    "angle of hinge elbow", "angle of hinges a, b", "lengths".
    """
    first = quantities[0]
    if len(quantities) == 1:
        return first.long_name if first.owner or not first.description else first.description
    owners = list(dict.fromkeys(quantity.owner for quantity in quantities))
    if (
        len({quantity.description or quantity.long_name for quantity in quantities}) == 1
        and first.description
    ):
        return (
            f"{first.description} of {_join_owners(owners)}" if first.owner else first.description
        )
    descriptions = list(
        dict.fromkeys(quantity.description or quantity.name for quantity in quantities)
    )
    if not any(owners) and len(descriptions) <= _MAX_NAMED_OWNERS:
        return ", ".join(descriptions)
    text = _NOUN_BY_UNIT.get(first.unit, "quantities")
    return f"{text} of {owners[0]}" if len(owners) == 1 and owners[0] else text


def _join_owners(owners: list[str]) -> str:
    """Joined owners: hinges elbow, wrist; rod1, rod2; 7 hinges."""
    words = {owner.partition(" ")[0] if " " in owner else "" for owner in owners}
    word = words.pop() if len(words) == 1 else ""
    if len(owners) == 1:
        return owners[0]
    if len(owners) > _MAX_NAMED_OWNERS:
        return f"{len(owners)} {word}s" if word else f"{len(owners)} bodies and ends"
    names = [owner.removeprefix(f"{word} ") if word else owner for owner in owners]
    return f"{word}s {', '.join(names)}" if word else ", ".join(names)
