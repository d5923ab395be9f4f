"""Atlas as a page in Markdown, with a table and a section for each case, and the plots of cases."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..runtime.figures import figure_style, new_figure, write_figure
from .case_definition import CaseResult, Points

INTRODUCTION = """\
# Failure atlas: limits of numerical methods

Find out where a numerical method fails, and what works there. `mstmm stability --out DIR` writes
this page and measures every limit by a coarse grid and bisection. A method *fails* where its error
measure exceeds the limit, or where there is no result. Arrows at the upper edge of a plot mean no
result, or one far beyond the axis. "tried to" is the end of the measured range of a method. "(end)"
means that the remedy holds over the whole measured range.
"""

_HEADINGS = ("case", "parameter", "measured", "limit", "fails", "remedy", "holds to")


def markdown_page(cases: Sequence[CaseResult], pictures: bool) -> str:
    """Whole page; with `pictures` it refers to NAME.png for each case, in the same folder."""
    rows = "\n".join(f"| {' | '.join(_table_row(case))} |" for case in cases)
    head = f"| {' | '.join(_HEADINGS)} |\n|{'---|' * len(_HEADINGS)}"
    case_sections = "\n".join(_section(case, pictures) for case in cases)
    return f"{INTRODUCTION}\n{head}\n{rows}\n\n{case_sections}"


def _table_row(case: CaseResult) -> tuple[str, ...]:
    return (
        f"[{case.name}](#{case.name})", parameter_with_unit(case), case.measured, limit_text(case),
        frontier_text(case), case.remedy, remedy_range(case),
    )  # fmt: skip


def format_number(value: float, digits: int = 3) -> str:
    """Format a number in common notation: 2.67e6, 1e5, and short ones in full."""
    if value == round(value) and abs(value) < 1000:
        return f"{value:.0f}"
    mantissa, _, power = f"{value:.{digits}g}".partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa


def parameter_with_unit(case: CaseResult) -> str:
    """Parameter of a case with its unit."""
    return f"{case.parameter} in {case.unit}" if case.unit else case.parameter


def frontier_text(case: CaseResult) -> str:
    """Name of the method, and where it starts to fail."""
    direction = "up" if case.failing_side == "above" else "down"
    return f"{case.method}, from {format_number(case.fails_at)} {direction}"


def limit_text(case: CaseResult) -> str:
    """Limit of the error measure, above which a method fails."""
    return format_number(case.limit)


def tested_range(case: CaseResult) -> float:
    """End of the range measured for the method, on the side on which it fails."""
    parameters = [parameter for parameter, _ in case.points]
    return max(parameters) if case.failing_side == "above" else min(parameters)


def remedy_range(case: CaseResult) -> str:
    """How far the remedy holds, with "(end)" if that is the end of the measured range."""
    return format_number(case.remedy_holds_to) + (" (end)" if case.remedy_fails_at is None else "")


def _section(case: CaseResult, pictures: bool) -> str:
    lines = [f"## {case.name}", "", f"*{case.title}.* {case.explanation}", ""]
    if pictures:
        lines += [f"![{case.title}]({case.name}.png)", ""]
    lines += [_result_list(case), "", f"Source: {case.source}.", ""]
    return "\n".join(lines)


def _result_list(case: CaseResult) -> str:
    remark = "" if case.monotone else "; beyond it holds at some values by chance"
    end = case.remedy_fails_at
    end_text = (
        "the end of the measured range" if end is None else f"fails at {format_number(end, 4)}"
    )
    return (
        f"- measured: {case.measured}; a failure above {limit_text(case)}\n"
        f"- {case.method}: holds at {format_number(case.holds_at, 4)}, fails at "
        f"{format_number(case.fails_at, 4)}{remark}; tried to "
        f"{format_number(tested_range(case), 4)}\n"
        f"- {case.remedy}: holds to {format_number(case.remedy_holds_to, 4)}, {end_text}"
    )


# --- plots of cases: both methods along the parameter, the limit and the failing side -------------

#: Colours that differ in grey and for colour-blind readers (Okabe and Ito, 2008).
_FAILURE_COLOUR, _REMEDY_COLOUR, _FAILURE_SIDE_COLOUR = "#D55E00", "#0072B2", "#fbe6da"

#: Range of measured values that is drawn.
_MIN_DRAWN, _MAX_DRAWN = 1e-17, 1e6

#: Ratio of measured values beyond which their axis is logarithmic.
_MIN_LOG_RATIO = 10.0

#: Fractions of the axis: space below the data, height of the data, position of arrows and of the
#: text above them.
_SPACE_BELOW, _DATA_HEIGHT, _ARROW_POSITION, _TEXT_POSITION = 0.05, 0.73, 0.84, 0.865

#: Number of characters that fit on a line of the legend.
_MAX_LEGEND_CHARACTERS = 80


@figure_style(9)
def draw_case(case: CaseResult, path: str | Path | None) -> Any:
    """Plot a case; see `MeasuredCase.plot`."""
    figure = new_figure(6.4, 3.7)
    _draw_axis(figure.subplots(), case)
    return write_figure(figure, path, "plot", dpi=110)


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
        xytext=(0, -7 if is_falling else 2 if is_off_scale else 7), textcoords="offset points",
        fontsize=8, color=_FAILURE_COLOUR, ha="center", va="top" if is_falling else "bottom",
    )  # fmt: skip


def _is_off_scale(measured: float) -> bool:
    """Whether there is no answer, or one far beyond the axis."""
    return not measured <= _MAX_DRAWN


def _draw_curve(axis: Any, points: Points, **style: Any) -> None:
    """Draw a line through the measured values, and arrows where there is no answer."""
    shown = [(parameter, max(m, _MIN_DRAWN)) for parameter, m in points if not _is_off_scale(m)]
    axis.plot(*zip(*shown, strict=True), linewidth=1.6, markersize=3.5, **style)
    off_scale = [parameter for parameter, m in points if _is_off_scale(m)]
    axis.plot(
        off_scale, [_ARROW_POSITION] * len(off_scale), transform=axis.get_xaxis_transform(),
        color=style["color"], marker=10, linestyle="none", markersize=5,
    )  # fmt: skip
