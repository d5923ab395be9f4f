"""What a chart says in words and tables, on the terminal and in its page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from mstmm.errors import MstmmError

from .chart_points import Point, Skipped
from .chart_record import ChartRecord

#: Of a point whose error may be the reference's own.
LIMITED = "not more than the reference's own error"

#: Headings, the columns that hold numbers, rows.
Table = tuple[Sequence[str], Sequence[int], Sequence[Sequence[str]]]


def recommendation(chart: ChartRecord) -> str:
    """The cheapest setting for the error wanted, or why there is none."""
    asked = f"for an error of {chart.wanted:.2g}{_unit(chart)}"
    try:
        best = chart.recommended()
    except MstmmError as problem:
        return f"{asked}: nothing to recommend, {problem}"
    level = f" on the model {best.model}" if len(chart.levels) > 1 else ""
    warned = "".join(f"; it warns: {text}" for text in best.warnings)
    return (
        f"{asked}: {best.method}, {best.setting}{level}, {time_of(best.cpu_s or 0.0)} CPU, error "
        f"{best.error:.1e}{warned}"
    )


def advice(chart: ChartRecord) -> Table:
    """The cheapest setting for every power of ten that one meets."""
    head = ("error asked", "method", "setting", "model", "CPU time", "error", "warnings")
    rows = [
        (
            f"{e:.0e}", p.method, str(p.setting), p.model, time_of(p.cpu_s or 0.0),
            f"{p.error:.1e}", str(len(p.warnings) or ""),
        )
        for e, p in chart.advice()
    ]  # fmt: skip
    return head, (0, 4, 5, 6), rows


def levels(chart: ChartRecord) -> Table:
    """Levels of model and their own errors; no rows where there is but one."""
    head = ("level", "its own error", "degrees of freedom", "engine")
    rows = [
        (
            level.name, "not found" if level.error is None else f"{level.error:.1e}",
            str(level.degrees_of_freedom), level.engine,
        )
        for level in chart.levels
    ]  # fmt: skip
    return head, (1, 2), rows if len(rows) > 1 else []


def points(chart: ChartRecord) -> Table:
    """Every run."""
    head = (
        "model", "method", "setting", "error", "CPU time", "runs", "steps", "evaluations",
        "factorizations", "note",
    )  # fmt: skip
    rows = [
        (
            p.model, p.method, str(p.setting), "" if p.error is None else f"{p.error:.2e}",
            "" if p.cpu_s is None else time_of(p.cpu_s), str(p.repeats or ""), _count(p.steps),
            _count(p.evaluations), _count(p.factorizations),
            p.failure or "; ".join(notes(p)),
        )
        for p in chart.points
    ]  # fmt: skip
    return head, (3, 4, 5, 6, 7, 8), rows


def notes(point: Point) -> list[str]:
    """What is to be said of a run beside its numbers."""
    found = [LIMITED] if point.limited else []
    return [*found, *(f"warns: {text}" for text in point.warnings)]


def skip_reasons(entries: Iterable[Skipped], refused: bool, most: int = 1000) -> list[str]:
    """A sentence for each reason, with at most so many of the methods that it holds for."""
    reasons: dict[str, dict[str, list[Skipped]]] = {}
    for one in entries:
        if one.refused == refused:
            reasons.setdefault(one.reason, {}).setdefault(one.method, []).append(one)
    return [f"{_named(methods, most)}{reason}" for reason, methods in reasons.items()]


def _named(methods: Mapping[str, Sequence[Skipped]], most: int) -> str:
    """rk4, step 1 s and on; dop853 (3 levels): ..."""
    texts = []
    for method, entries in methods.items():
        models, settings = [one.model for one in entries], {one.setting for one in entries}
        words = [method, *settings] if len(settings) == 1 else [method]
        text = ", ".join(word for word in words if word) or ", ".join(models)
        texts.append(f"{text} ({len(models)} levels)" if method and len(models) > 1 else text)
    texts = [text for text in texts if text]
    if len(texts) > most:
        texts[most:] = [f"and {len(texts) - most} more"]
    return "; ".join(texts) + ": " if texts else ""


def time_of(seconds: float) -> str:
    """0.00123 s as 1.23 ms."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def _unit(chart: ChartRecord) -> str:
    return "" if chart.reference.unit == "1" else f" {chart.reference.unit}"


def _count(number: int | None) -> str:
    return "" if number is None else str(number)
