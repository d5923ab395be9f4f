"""The atlas as a page in Markdown: a table, and a part for each case."""

from __future__ import annotations

from collections.abc import Sequence

from .found import Found

HEAD = """\
# Where methods fail

The atlas of failures, written by `mstmm stability --out DIR`. Every frontier is found in the run,
by a coarse grid and bisection, and nothing of it is typed in. A method *fails* where what is
measured is above the limit that its case states, or where there is no answer at all; arrows at the
upper edge of a picture stand for no answer, or one far beyond the axis. "(end)" says that the
remedy holds as far as it was tried.
"""

_ROW = "| [{name}](#{name}) | {parameter} | {frontier} | {remedy} | {reach} |"


def page(cases: Sequence[Found], pictures: bool) -> str:
    """The whole page; with `pictures`, NAME.png lies beside it for each case."""
    rows = "\n".join(_ROW.format(**_row(case)) for case in cases)
    head = "| case | parameter | fails | remedy | holds to |\n|---|---|---|---|---|"
    parts = "\n".join(_part(case, pictures) for case in cases)
    return f"{HEAD}\n{head}\n{rows}\n\n{parts}"


def _row(case: Found) -> dict[str, str]:
    return {
        "name": case.name,
        "parameter": in_unit(case),
        "frontier": frontier(case),
        "remedy": case.remedy,
        "reach": held_to(case),
    }


def in_unit(case: Found) -> str:
    """The parameter with its unit."""
    return f"{case.parameter} in {case.unit}" if case.unit else case.parameter


def frontier(case: Found) -> str:
    """What fails, and from where on."""
    step = "from" if case.fails == "above" else "down from"
    return f"{case.method}, {step} {case.fails_at:.3g} on"


def held_to(case: Found) -> str:
    """How far the remedy holds; with a plus where that is only as far as it was tried."""
    return f"{case.remedy_holds_to:.3g}" + (" (end)" if case.remedy_fails_at is None else "")


def _part(case: Found, pictures: bool) -> str:
    lines = [f"## {case.name}", "", f"*{case.title}.* {case.why}", ""]
    if pictures:
        lines += [f"![{case.title}]({case.name}.png)", ""]
    lines += [_judged(case), "", f"Source: {case.source}.", ""]
    return "\n".join(lines)


def _judged(case: Found) -> str:
    said = (
        f"Measured: {case.measured}; a failure above {case.limit:g}. {case.method}: holds at "
        f"{case.holds_at:.4g}, fails at {case.fails_at:.4g}. {case.remedy}: "
    )
    if case.remedy_fails_at is None:
        said += f"holds to {case.remedy_holds_to:.4g}, the end of what is tried."
    else:
        said += f"holds to {case.remedy_holds_to:.4g}, fails at {case.remedy_fails_at:.4g}."
    if not case.monotone:
        said += " Beyond the frontier the method holds here and there by chance."
    return said
