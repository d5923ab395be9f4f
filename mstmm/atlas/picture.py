"""Plot of a case: both methods along the parameter, the limit, and the failing side."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import SceneError
from ..optional_packages import figure_class
from ..runtime.platform_support.safe_files import replace_atomically
from .page import format_number, tested_range

if TYPE_CHECKING:
    from .case_definition import CaseResult, Points

#: Colours that differ in grey and for colour-blind readers (Okabe and Ito, 2008).
_FAILURE_COLOUR, _REMEDY_COLOUR, _FAILURE_SIDE_COLOUR = "#D55E00", "#0072B2", "#fbe6da"

_STYLE: dict[str, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "axes.edgecolor": "#555555",
    "axes.axisbelow": True,
    "legend.frameon": False,
    "savefig.dpi": 110,
}

#: Range of measured values that is drawn.
_MIN_DRAWN, _MAX_DRAWN = 1e-17, 1e6

#: Ratio of measured values beyond which their axis is logarithmic.
_MIN_LOG_RATIO = 10.0

#: Fractions of the axis: space below the data, height of the data, position of arrows and of the
#: text above them.
_SPACE_BELOW, _DATA_HEIGHT, _ARROW_POSITION, _TEXT_POSITION = 0.05, 0.73, 0.84, 0.865

#: Number of characters that fit on a line of the legend.
_MAX_LEGEND_CHARACTERS = 80


def draw_case(case: CaseResult, path: Path | None) -> Any:
    """Plot a case; see `MeasuredCase.plot`."""
    Figure = figure_class()
    import matplotlib as mpl

    style: Any = _STYLE
    with mpl.rc_context(style):
        figure = Figure(figsize=(6.4, 3.7), layout="constrained")
        _draw_axis(figure.subplots(), case)
        if path is not None:
            _save_figure(figure, path)
    return figure


def _draw_axis(axis: Any, case: CaseResult) -> None:
    all_points = (*case.points, *case.remedy_points)
    left, right = min(all_points)[0], max(all_points)[0]
    if case.scale != "linear":
        axis.set_xscale("log")
    if case.scale == "count":
        _set_integer_ticks(axis, left, right)
    _set_value_axis(axis, all_points, case.limit)
    axis.axvspan(
        case.fails_at,
        right if case.failing_side == "above" else left,
        color=_FAILURE_SIDE_COLOUR,
        zorder=0,
    )
    axis.axvline(case.fails_at, color=_FAILURE_COLOUR, linewidth=1.0, linestyle=":")
    axis.axhline(case.limit, color="#555555", linewidth=1.0, linestyle="--")
    _draw_curve(axis, case.points, color=_FAILURE_COLOUR, marker="o", label=case.method)
    _draw_curve(axis, case.remedy_points, color=_REMEDY_COLOUR, marker="s", label=case.remedy)
    _label_frontier(axis, case.fails_at)
    if tested_range(case) not in (left, right):
        _label_end(axis, case)
    axis.set_title(case.title, loc="left", fontsize=10, fontweight="bold")
    axis.set_xlabel(f"{case.parameter} in {case.unit}" if case.unit else case.parameter)
    axis.set_ylabel(case.measured)
    handles, _ = axis.get_legend_handles_labels()
    if any(_is_off_scale(measured) for _, measured in all_points):
        handles += axis.plot([], [], color="#777777", marker=10, linestyle="none", markersize=5,
                             label="no answer, or far above")  # fmt: skip
    is_wide = sum(len(handle.get_label()) for handle in handles) > _MAX_LEGEND_CHARACTERS
    axis.figure.legend(
        handles=handles, loc="outside lower center", ncols=2 if is_wide else 3, handlelength=1.4,
        columnspacing=1.2, fontsize=8,
    )  # fmt: skip


def _set_integer_ticks(axis: Any, left: float, right: float) -> None:
    """Set ticks at integers on a short axis, at powers of ten on a long one."""
    steps = (1, 2, 5) if right < 300 * left else (1,)
    powers = range(int(math.log10(left)), int(math.log10(right)) + 1)
    ticks = [step * 10**power for power in powers for step in steps]
    shown = [tick for tick in ticks if left <= tick <= right]
    axis.set_xticks(shown, [f"{tick:,}".replace(",", " ") for tick in shown])
    axis.minorticks_off()


def _set_value_axis(axis: Any, points: Points, limit: float) -> None:
    """Set scale and limits of the axis of measured values: all finite ones, with space above."""
    finite_values = [min(max(m, _MIN_DRAWN), _MAX_DRAWN) for _, m in points if math.isfinite(m)]
    low, high = min(*finite_values, limit), max(*finite_values, limit)
    if high > _MIN_LOG_RATIO * low:
        axis.set_yscale("log")
        axis_height = (high / low) ** (1 / _DATA_HEIGHT)
        axis.set_ylim(
            low / axis_height**_SPACE_BELOW, low / axis_height**_SPACE_BELOW * axis_height
        )
    else:
        axis_height = (high - low) / _DATA_HEIGHT
        axis.set_ylim(
            low - _SPACE_BELOW * axis_height, low - _SPACE_BELOW * axis_height + axis_height
        )


def _label_frontier(axis: Any, value: float) -> None:
    """Label the frontier with its parameter, at the top, on the side with more space."""
    axis.autoscale_view()  # otherwise the transformation is that of an empty axis
    left, _ = axis.transAxes.inverted().transform(axis.transData.transform((value, 1.0)))
    axis.annotate(
        f"fails at {format_number(value)}", (value, 0.985), xycoords=("data", "axes fraction"),
        xytext=(-4 if left > 0.5 else 4, 0), textcoords="offset points", color=_FAILURE_COLOUR,
        ha="right" if left > 0.5 else "left", va="top",
    )  # fmt: skip


def _label_end(axis: Any, case: CaseResult) -> None:
    """Label the end of the measured range, above the last mark, or below a falling curve."""
    previous_point, last_point = sorted(case.points, reverse=case.failing_side == "below")[-2:]
    parameter, measured = last_point
    is_off_scale = _is_off_scale(measured)
    is_falling = not is_off_scale and measured < previous_point[1]
    axis.annotate(
        f"tried to {format_number(parameter)}",
        (parameter, _TEXT_POSITION if is_off_scale else max(measured, _MIN_DRAWN)),
        xycoords=("data", "axes fraction" if is_off_scale else "data"),
        xytext=(0, -7 if is_falling else 2 if is_off_scale else 7),
        textcoords="offset points",
        fontsize=8,
        color=_FAILURE_COLOUR,
        ha="center",
        va="top" if is_falling else "bottom",
    )


def _is_off_scale(measured: float) -> bool:
    """Whether there is no answer, or one far beyond the axis."""
    return not measured <= _MAX_DRAWN


def _draw_curve(axis: Any, points: Points, **style: Any) -> None:
    """Draw a line through the measured values, and arrows where there is no answer."""
    shown = [(parameter, max(m, _MIN_DRAWN)) for parameter, m in points if not _is_off_scale(m)]
    axis.plot(*zip(*shown, strict=True), linewidth=1.6, markersize=3.5, **style)
    off_scale = [parameter for parameter, m in points if _is_off_scale(m)]
    axis.plot(
        off_scale,
        [_ARROW_POSITION] * len(off_scale),
        transform=axis.get_xaxis_transform(),
        color=style["color"],
        marker=10,
        linestyle="none",
        markersize=5,
    )


def _save_figure(figure: Any, path: Path) -> None:
    kind = path.suffix.lower().lstrip(".")
    if kind not in ("png", "svg", "pdf"):
        raise SceneError(f'plot "{path}": expected a name that ends in .png, .svg or .pdf')
    with replace_atomically(path) as temporary:
        figure.savefig(temporary, format=kind)
