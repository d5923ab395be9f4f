"""Figures of runs: panels of curves and pictures of flexible bodies (extra: plot)."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.arguments import path_of, short, text_of, word_of
from mstmm.arrays import by_name
from mstmm.errors import SceneError
from mstmm.extras import figures
from mstmm.printable import printable

from ...host.files import replacing
from ..flexible.pictures import Picture, picture
from ..flexible.pictures import names as names_of_pictures
from .panels import Panel, Trace, Wanted, panels, steady
from .shown import Shown

#: Colours that stay apart in grey and for colour-blind readers (Okabe and Ito, 2008).
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#F0E442")

_STYLE: dict[str, Any] = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.7,
    "axes.edgecolor": "#555555",
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "savefig.dpi": 150,
}

#: Inches of a panel of curves, and more of one that has both axes to one scale.
_HEIGHT, _EQUAL = 2.3, 0.9

#: How curves of equal colour differ, and points; the colour of runs in a legend of both.
_STYLES = ("-", (0, (5, 1.6)), (0, (1.2, 1.4)), (0, (6, 1.5, 1.2, 1.5)))
_MARKS, _RUN = ("o", "s", "^", "D"), "#555555"

#: Amplitudes below this part of the largest are rounding and left out of sight.
_FLOOR = 1e-6


@dataclass(frozen=True)
class Drawn:
    """A figure with what is in it: names of pictures of flexible bodies, and panels of curves."""

    figure: Any
    shapes: tuple[str, ...]
    panels: tuple[Panel, ...]

    def write(self, path: Path) -> None:
        """Into a file; SceneError for another ending than .png, .svg or .pdf."""
        import matplotlib as mpl

        kind = path.suffix.lower().lstrip(".")
        if kind not in self.figure.canvas.get_supported_filetypes():
            raise SceneError(f'picture "{path}": expected a name that ends in .png, .svg or .pdf')
        style: Any = _STYLE
        with mpl.rc_context(style), replacing(path) as temporary:
            self.figure.savefig(temporary, format=kind)


def drawn(
    runs: Mapping[str, Shown], wanted: Wanted, title: str | None = None, ax: Any = None
) -> Drawn:
    """Runs by their labels in one figure; see `Result.plot`.

    Raises SceneError for an unknown name, EnvironmentFailure without the extra.
    """
    for label, run in runs.items():
        if not len(run.t):
            which = f"{label}: " if len(runs) > 1 else ""
            raise SceneError(
                f"{which}there is nothing to plot: the run has no sample; ask for other times"
            )
    shapes, curves = _sorted(runs, wanted)
    made = panels(runs, replace(wanted, names=curves)) if curves or not wanted.names else []
    return _composed([_shape(runs, name) for name in shapes], shapes, made, title, ax)


def compose(made: Sequence[Panel], title: str | None = None, ax: Any = None) -> Drawn:
    """Panels of curves in one figure.  EnvironmentFailure without the extra."""
    return _composed([], (), made, title, ax)


def _composed(
    pictures: list[Picture], shapes: tuple[str, ...], made: Sequence[Panel], title: str | None,
    ax: Any,
) -> Drawn:  # fmt: skip
    Figure = figures()
    import matplotlib as mpl

    pictures += [
        Picture(partial(_draw, one), _HEIGHT + (_EQUAL if one.alike else 0), one.kind == "time")
        for one in made
    ]
    if not pictures:
        raise SceneError("there is nothing to plot: give the name of a quantity, such as energy")
    style: Any = _STYLE
    with mpl.rc_context(style):
        if ax is not None:
            figure = _into(ax, pictures)
        else:
            height = 1.0 + sum(one.height for one in pictures)
            figure = Figure(figsize=(7.5, height), layout="constrained")
            _lay_out(figure, pictures)
        if title:
            figure.suptitle(printable(title), parse_math=False)
    return Drawn(figure, shapes, tuple(made))


def plot_of(
    run: Shown, names: Sequence[str], *, path: str | Path | None = None, title: str | None = None,
    ax: Any = None, against: str | None = None, kind: str = "time",
    beside: Mapping[str, Shown] | None = None, label: str = "this run",
) -> Any:  # fmt: skip
    """One run, and others beside it; see `Result.plot`."""
    where = None if path is None else path_of("picture", path)
    runs: dict[str, Shown] = {word_of("label", label, "a text"): run}
    for other, one in ({} if beside is None else by_name("beside", beside, "runs")).items():
        if other in runs:
            raise SceneError(f'beside: "{other}" is the label of another run; give each its own')
        if not hasattr(one, "candidates"):
            raise SceneError(f'beside: "{other}" = {short(one)}: expected a result')
        runs[other] = one
    made = drawn(runs, Wanted(tuple(names), against, kind), text_of("title", title), ax)
    if where is not None:
        made.write(where)
    return made.figure


def _sorted(runs: Mapping[str, Shown], wanted: Wanted) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of pictures of flexible bodies, and those of quantities."""
    record: Any = next(iter(runs.values()))
    names = tuple(dict.fromkeys(wanted.names))
    if len(runs) > 1 or wanted.kind != "time" or wanted.against or not hasattr(record, "model"):
        return (), names
    if not names:
        return (("shape",) if record.model.flexible else ()), ()
    known = set(names_of_pictures(record))
    return tuple(x for x in names if x in known), tuple(x for x in names if x not in known)


def _shape(runs: Mapping[str, Shown], name: str) -> Picture:
    record: Any = next(iter(runs.values()))
    found = picture(record, name)
    assert found is not None, name
    return found


def _lay_out(figure: Any, found: Sequence[Picture]) -> None:
    """Pictures below each other, all panels over time with one time axis below the last."""
    groups = [[one] for one in found if not one.over_time]
    groups += [[one for one in found if one.over_time]]
    groups = [group for group in groups if group]
    heights = [sum(one.height for one in group) for group in groups]
    parts = figure.subfigures(len(groups), 1, height_ratios=heights, squeeze=False)[:, 0]
    for part, group in zip(parts, groups, strict=True):
        within = [one.height for one in group]
        axes = part.subplots(len(group), 1, height_ratios=within, sharex=True, squeeze=False)[:, 0]
        for axis, one in zip(axes, group, strict=True):
            one.draw(part, axis)
        if group[0].over_time:
            axes[-1].set_xlabel("time (s)")


def _into(ax: Any, found: Sequence[Picture]) -> Any:
    """Draw into axes of somebody else's figure."""
    axes = list(np.ravel(np.asarray(ax, dtype=object)))
    if not all(hasattr(axis, "figure") for axis in axes):
        raise SceneError(f"ax = {short(ax)}: expected axes of matplotlib, or a list of them")
    if len(axes) != len(found):
        raise SceneError(
            f"ax: there are {len(found)} panels, one for each unit, and {len(axes)} axes; give as "
            "many axes, or quantities of one unit"
        )
    for axis, one in zip(axes, found, strict=True):
        one.draw(axis.figure, axis)
        if one.over_time:
            axis.set_xlabel("time (s)")
    return axes[0].figure


def _draw(panel: Panel, figure: Any, axis: Any) -> None:
    """The curves of one panel, broken where an event makes them jump."""
    for trace in panel.traces:
        _curve(axis, trace)
    axis.set_title(panel.title, loc="left", fontsize=10, parse_math=False)
    axis.margins(x=0.01)
    if panel.kind != "time":
        axis.set_xlabel(panel.x, parse_math=False)
    if panel.kind == "spectrum":
        _amplitudes(axis, panel)
    elif panel.alike:
        axis.set_aspect("equal", "datalim")
    elif (ends := steady(panel)) is not None:
        axis.set_ylim(*ends)
    if len(panel.traces) > 1 or panel.more:
        axis.legend(handles=_entries(axis, panel), loc="upper left", bbox_to_anchor=(1.0, 1.0),
                    handlelength=1.8)  # fmt: skip


def _entries(axis: Any, panel: Panel) -> list[Any]:
    """Of the legend: every curve, or every column by its colour and then every run by its dashes,
    and what was left out."""
    from matplotlib.lines import Line2D

    found: list[Any] = axis.get_legend_handles_labels()[0]
    if all(trace.run for trace in panel.traces):
        by_column = {trace.column: _look(replace(trace, style=0)) for trace in panel.traces}
        by_run = {trace.run: _look(replace(trace, colour=0)) for trace in panel.traces}
        found = [Line2D([], [], label=column, **look) for column, look in by_column.items()]
        found += [
            Line2D([], [], label=run, **look | {"color": _RUN}) for run, look in by_run.items()
        ]
    if panel.more:
        found.append(Line2D([], [], linestyle=" ", label=_folded(panel.more)))
    return found


def _curve(axis: Any, trace: Trace) -> None:
    look = _look(trace)
    axis.plot(trace.x, trace.y, label=trace.label, **look)
    if trace.low is not None and trace.high is not None:
        axis.fill_between(
            trace.x, trace.low, trace.high, color=look["color"], alpha=0.2, linewidth=0
        )


def _look(trace: Trace) -> dict[str, Any]:
    """Colour and dashes of a curve, or the mark of one that is a point."""
    turn = trace.style + trace.colour // len(_COLOURS)
    return {
        "color": _COLOURS[trace.colour % len(_COLOURS)],
        "linestyle": _STYLES[turn % len(_STYLES)],
        "marker": _MARKS[turn % len(_MARKS)] if len(trace.x) == 1 else None,
    }


def _amplitudes(axis: Any, panel: Panel) -> None:
    largest = max(float(trace.y.max()) for trace in panel.traces)
    if largest > 0:
        axis.set_yscale("log")
        axis.set_ylim(_FLOOR * largest, 2 * largest)


def _folded(text: str) -> str:
    return "\n".join(textwrap.wrap(text, 22))
