"""Atlas as a page in Markdown: a table, and a section for each case."""

from __future__ import annotations

from collections.abc import Sequence

from .case_definition import CaseResult

INTRODUCTION = """\
# Failure atlas: limits of numerical methods

Find out where a numerical method fails, and what works there. `mstmm stability --out DIR` writes
this page and measures every limit by a coarse grid and bisection. A method *fails* where its error
measure exceeds the limit, or where there is no result. Arrows at the upper edge of a plot mean no
result, or one far beyond the axis. "tried to" is the end of the measured range of a method. "(end)"
means that the remedy holds over the whole measured range.
"""

_HEADINGS = ("case", "parameter", "measured", "limit", "fails", "remedy", "holds to")
_ROW = (
    "| [{name}](#{name}) | {parameter} | {measured} | {limit} | {frontier} | {remedy} | {reach} |"
)


def markdown_page(cases: Sequence[CaseResult], pictures: bool) -> str:
    """Whole page; with `pictures` it refers to NAME.png for each case, in the same folder."""
    rows = "\n".join(_ROW.format(**_table_row(case)) for case in cases)
    head = f"| {' | '.join(_HEADINGS)} |\n|{'---|' * len(_HEADINGS)}"
    case_sections = "\n".join(_section(case, pictures) for case in cases)
    return f"{INTRODUCTION}\n{head}\n{rows}\n\n{case_sections}"


def _table_row(case: CaseResult) -> dict[str, str]:
    return {
        "name": case.name,
        "parameter": parameter_with_unit(case),
        "measured": case.measured,
        "limit": limit_text(case),
        "frontier": frontier_text(case),
        "remedy": case.remedy,
        "reach": remedy_range(case),
    }


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
