"""Figures of runs: panels of curves and plots of flexible bodies (extra: plot)."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.argument_validation import abbreviate, optional_text, require_path, require_word
from mstmm.array_validation import mapping_by_name
from mstmm.display import escape_control_characters
from mstmm.errors import SceneError

from ...figures import curve_marker, curve_style, figure_style, new_figure, write_figure
from ..flexible.shape_panels import ShapePanel, shape_panel
from ..flexible.shape_panels import panel_names as names_of_pictures
from .default_quantities import PlotSource
from .panels import Panel, PlotSelection, Trace, build_panels, constant_axis_limits

#: Inches: height of a panel of curves, and extra height of one with equal scales on both axes.
_PANEL_HEIGHT, _EXTRA_HEIGHT = 2.3, 0.9

#: Colour of runs in a combined legend.
_RUN_COLOUR = "#555555"

#: Amplitudes below this part of the largest are rounding and not shown.
_MIN_AMPLITUDE_RATIO = 1e-6


@dataclass(frozen=True)
class PlottedFigure:
    """Figure with its contents: names of shape panels, and panels of curves."""

    figure: Any
    shapes: tuple[str, ...]
    panels: tuple[Panel, ...]

    def write(self, path: Path) -> None:
        """Write the figure to a file; SceneError for a suffix other than .png, .svg or .pdf."""
        write_figure(self.figure, path)


def draw_runs(
    runs: Mapping[str, PlotSource],
    selection: PlotSelection,
    title: str | None = None,
    ax: Any = None,
) -> PlottedFigure:
    """Draw runs by their labels in one figure; see `Result.plot`.

    Raises SceneError for an unknown name, EnvironmentFailure without the extra.
    """
    for label, run in runs.items():
        if not len(run.t):
            prefix = f"{label}: " if len(runs) > 1 else ""
            raise SceneError(
                f"{prefix}nothing to plot: the run has no samples; give other output times"
            )
    shapes, curves = _split_names(runs, selection)
    quantity_panels = (
        build_panels(runs, replace(selection, names=curves))
        if curves or not selection.names
        else []
    )
    record: Any = next(iter(runs.values()))
    return _compose_figure(
        [shape_panel(record, name) for name in shapes], shapes, quantity_panels, title, ax
    )


def compose_panels(
    panels: Sequence[Panel], title: str | None = None, ax: Any = None
) -> PlottedFigure:
    """Compose panels of curves in one figure. EnvironmentFailure without the extra."""
    return _compose_figure([], (), panels, title, ax)


@figure_style()
def _compose_figure(
    pictures: list[ShapePanel], shapes: tuple[str, ...], panels: Sequence[Panel], title: str | None,
    ax: Any,
) -> PlottedFigure:  # fmt: skip
    pictures += [
        ShapePanel(
            partial(_draw_panel, panel),
            _PANEL_HEIGHT + (_EXTRA_HEIGHT if panel.alike else 0),
            panel.kind == "time",
        )
        for panel in panels
    ]
    if not pictures:
        raise SceneError("nothing to plot: give the name of a quantity, such as energy")
    if ax is not None:
        figure = _draw_into(ax, pictures)
    else:
        figure = new_figure(7.5, 1.0 + sum(panel.height for panel in pictures))
        _lay_out(figure, pictures)
    if title:
        figure.suptitle(escape_control_characters(title), parse_math=False)
    return PlottedFigure(figure, shapes, tuple(panels))


def plot_of(
    run: PlotSource,
    names: Sequence[str],
    *,
    path: str | Path | None = None,
    title: str | None = None,
    ax: Any = None,
    against: str | None = None,
    kind: str = "time",
    beside: Mapping[str, PlotSource] | None = None,
    label: str = "this run",
) -> Any:
    """Plot one run together with others; see `Result.plot`."""
    file_path = None if path is None else require_path("picture", path)
    runs: dict[str, PlotSource] = {require_word("label", label, "a text"): run}
    for other_label, other_run in (
        {} if beside is None else mapping_by_name("beside", beside, "runs")
    ).items():
        if other_label in runs:
            raise SceneError(
                f'beside: "{other_label}" is the label of another run; give each run its own label'
            )
        if not hasattr(other_run, "default_quantities"):
            raise SceneError(
                f'beside: "{other_label}" = {abbreviate(other_run)}: expected a result'
            )
        runs[other_label] = other_run
    plotted = draw_runs(
        runs, PlotSelection(tuple(names), against, kind), optional_text("title", title), ax
    )
    if file_path is not None:
        plotted.write(file_path)
    return plotted.figure


def _split_names(
    runs: Mapping[str, PlotSource], selection: PlotSelection
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of shape panels, and names of quantities."""
    record: Any = next(iter(runs.values()))
    names = tuple(dict.fromkeys(selection.names))
    if (
        len(runs) > 1
        or selection.kind != "time"
        or selection.against
        or not hasattr(record, "model")
    ):
        return (), names
    if not names:
        return (("shape",) if record.model.flexible_bodies else ()), ()
    shape_names = set(names_of_pictures(record))
    return tuple(x for x in names if x in shape_names), tuple(
        x for x in names if x not in shape_names
    )


def _lay_out(figure: Any, shape_panels: Sequence[ShapePanel]) -> None:
    """Arrange the panels in a column; panels over time share one time axis below the last."""
    groups = [[panel] for panel in shape_panels if not panel.over_time]
    groups += [[panel for panel in shape_panels if panel.over_time]]
    groups = [group for group in groups if group]
    heights = [sum(panel.height for panel in group) for group in groups]
    parts = figure.subfigures(len(groups), 1, height_ratios=heights, squeeze=False)[:, 0]
    for part, group in zip(parts, groups, strict=True):
        within = [panel.height for panel in group]
        axes = part.subplots(len(group), 1, height_ratios=within, sharex=True, squeeze=False)[:, 0]
        for axis, panel in zip(axes, group, strict=True):
            panel.draw(part, axis)
        if group[0].over_time:
            axes[-1].set_xlabel("time (s)")


def _draw_into(ax: Any, shape_panels: Sequence[ShapePanel]) -> Any:
    """Draw into axes of an existing figure."""
    axes = list(np.ravel(np.asarray(ax, dtype=object)))
    if not all(hasattr(axis, "figure") for axis in axes):
        raise SceneError(f"ax = {abbreviate(ax)}: expected axes of matplotlib, or a list of them")
    if len(axes) != len(shape_panels):
        raise SceneError(
            f"ax: there are {len(shape_panels)} panels, one for each unit, and {len(axes)} axes; "
            "give as many axes, or quantities of one unit"
        )
    for axis, panel in zip(axes, shape_panels, strict=True):
        panel.draw(axis.figure, axis)
        if panel.over_time:
            axis.set_xlabel("time (s)")
    return axes[0].figure


def _draw_panel(panel: Panel, figure: Any, axis: Any) -> None:
    """Draw the curves of one panel, with gaps where an event makes them jump."""
    for trace in panel.traces:
        _draw_curve(axis, trace)
    axis.set_title(panel.title, loc="left", fontsize=10, parse_math=False)
    axis.margins(x=0.01)
    if panel.kind != "time":
        axis.set_xlabel(panel.x, parse_math=False)
    if panel.kind == "spectrum":
        _set_amplitude_axis(axis, panel)
    elif panel.alike:
        axis.set_aspect("equal", "datalim")
    elif (ends := constant_axis_limits(panel)) is not None:
        axis.set_ylim(*ends)
    if len(panel.traces) > 1 or panel.more:
        axis.legend(
            handles=_legend_entries(axis, panel),
            loc="upper left",
            bbox_to_anchor=(1.0, 1.0),
            handlelength=1.8,
        )


def _legend_entries(axis: Any, panel: Panel) -> list[Any]:
    """Legend entries: every curve, or columns by colour and then runs by line style.

    The last entry describes what was left out.
    """
    from matplotlib.lines import Line2D

    handles: list[Any] = axis.get_legend_handles_labels()[0]
    if all(trace.run for trace in panel.traces):
        by_column = {trace.column: _line_style(replace(trace, style=0)) for trace in panel.traces}
        by_run = {trace.run: _line_style(replace(trace, colour=0)) for trace in panel.traces}
        handles = [Line2D([], [], label=column, **look) for column, look in by_column.items()]
        handles += [
            Line2D([], [], label=run, **look | {"color": _RUN_COLOUR})
            for run, look in by_run.items()
        ]
    if panel.more:
        handles.append(Line2D([], [], linestyle=" ", label=textwrap.fill(panel.more, 22)))
    return handles


def _draw_curve(axis: Any, trace: Trace) -> None:
    style = _line_style(trace)
    axis.plot(trace.x, trace.y, label=trace.label, **style)
    if trace.low is not None and trace.high is not None:
        axis.fill_between(
            trace.x, trace.low, trace.high, color=style["color"], alpha=0.2, linewidth=0
        )


def _line_style(trace: Trace) -> dict[str, Any]:
    """Colour and line style of a curve, or the marker of a single point."""
    marker = curve_marker(trace.colour, trace.style) if len(trace.x) == 1 else None
    return {**curve_style(trace.colour, trace.style), "marker": marker}


def _set_amplitude_axis(axis: Any, panel: Panel) -> None:
    largest = max(float(trace.y.max()) for trace in panel.traces)
    if largest > 0:
        axis.set_yscale("log")
        axis.set_ylim(_MIN_AMPLITUDE_RATIO * largest, 2 * largest)
