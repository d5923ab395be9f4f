"""Atlas as a page in Markdown: a table, and a section for each case."""

from __future__ import annotations

from collections.abc import Sequence

from .found import Found

HEAD = """\
# Failure atlas: limits of numerical methods

Atlas of failures, written by `mstmm stability --out DIR`. Every frontier is measured in that run,
by a coarse grid and bisection. A method *fails* where its error measure exceeds the limit, or where
there is no answer. Arrows at the upper edge of a plot mean no answer, or one far beyond the axis.
"tried to" marks the end of the range that was measured for a method. "(end)" means that the remedy
holds over the whole range that was measured.
"""

_HEADINGS = ("case", "parameter", "measured", "limit", "fails", "remedy", "holds to")
_ROW = (
    "| [{name}](#{name}) | {parameter} | {measured} | {limit} | {frontier} | {remedy} | {reach} |"
)


def page(cases: Sequence[Found], pictures: bool) -> str:
    """Whole page; with `pictures` it refers to NAME.png for each case, in the same folder."""
    rows = "\n".join(_ROW.format(**_row(case)) for case in cases)
    head = f"| {' | '.join(_HEADINGS)} |\n|{'---|' * len(_HEADINGS)}"
    parts = "\n".join(_part(case, pictures) for case in cases)
    return f"{HEAD}\n{head}\n{rows}\n\n{parts}"


def _row(case: Found) -> dict[str, str]:
    return {
        "name": case.name,
        "parameter": in_unit(case),
        "measured": case.measured,
        "limit": limit(case),
        "frontier": frontier(case),
        "remedy": case.remedy,
        "reach": held_to(case),
    }


def number(value: float, digits: int = 3) -> str:
    """Format a number in common notation: 2.67e6, 1e5, and short ones in full."""
    if value == round(value) and abs(value) < 1000:
        return f"{value:.0f}"
    mantissa, _, power = f"{value:.{digits}g}".partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa


def in_unit(case: Found) -> str:
    """Parameter of a case with its unit."""
    return f"{case.parameter} in {case.unit}" if case.unit else case.parameter


def frontier(case: Found) -> str:
    """Name of the method, and where it starts to fail."""
    step = "up" if case.fails == "above" else "down"
    return f"{case.method}, from {number(case.fails_at)} {step}"


def limit(case: Found) -> str:
    """Limit of the error measure, above which a method fails."""
    return number(case.limit)


def tried_to(case: Found) -> float:
    """End of the range measured for the method, on the side on which it fails."""
    ends = [at for at, _ in case.points]
    return max(ends) if case.fails == "above" else min(ends)


def held_to(case: Found) -> str:
    """How far the remedy holds, with "(end)" if that is the end of the measured range."""
    return number(case.remedy_holds_to) + (" (end)" if case.remedy_fails_at is None else "")


def _part(case: Found, pictures: bool) -> str:
    lines = [f"## {case.name}", "", f"*{case.title}.* {case.why}", ""]
    if pictures:
        lines += [f"![{case.title}]({case.name}.png)", ""]
    lines += [_judged(case), "", f"Source: {case.source}.", ""]
    return "\n".join(lines)


def _judged(case: Found) -> str:
    chance = "" if case.monotone else "; beyond it holds in places, by chance"
    end = case.remedy_fails_at
    beyond = "the end of the range" if end is None else f"fails at {number(end, 4)}"
    return (
        f"- measured: {case.measured}; a failure above {limit(case)}\n"
        f"- {case.method}: holds at {number(case.holds_at, 4)}, fails at "
        f"{number(case.fails_at, 4)}{chance}; tried to {number(tried_to(case), 4)}\n"
        f"- {case.remedy}: holds to {number(case.remedy_holds_to, 4)}, {beyond}"
    )
