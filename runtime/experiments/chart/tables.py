"""Tables and sentences of a chart, for the terminal and the HTML page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from mstmm.errors import MstmmError

from .chart_record import ChartRecord, Point, Skipped

#: Note on a point whose error may be that of the reference.
_LIMITED = "error not resolved by the reference"

#: Headings, indices of the columns that hold numbers, rows.
Table = tuple[Sequence[str], Sequence[int], Sequence[Sequence[str]]]


def recommendation(chart: ChartRecord) -> str:
    """The cheapest setting for the target error, or why there is none."""
    target = f"for an error of {chart.target_error:.2g}{_unit(chart)}"
    try:
        best = chart.recommend()
    except MstmmError as problem:
        return f"{target}: no recommendation: {problem}"
    level = f" on the model level {best.model}" if len(chart.model_levels) > 1 else ""
    warnings = "".join(f"; warning: {text}" for text in best.warnings)
    return (
        f"{target}: {best.method}, {best.setting}{level}, {format_time(best.cpu_s or 0.0)} CPU, "
        f"error {best.error:.1e}{warnings}"
    )


def recommendation_table(chart: ChartRecord) -> Table:
    """The cheapest setting for every power of ten that is reached as error."""
    head = ("target error", "method", "setting", "model", "CPU time", "error", "warnings")
    rows = [
        (
            f"{target:.0e}", point.method, str(point.setting), point.model,
            format_time(point.cpu_s or 0.0), f"{point.error:.1e}", str(len(point.warnings) or ""),
        )
        for target, point in chart.recommendations()
    ]  # fmt: skip
    return head, (0, 4, 5, 6), rows


def level_table(chart: ChartRecord) -> Table:
    """Model levels and their own errors; no rows if there is only one."""
    head = ("level", "own error", "degrees of freedom", "engine")
    rows = [
        (
            level.name, "unknown" if level.error is None else f"{level.error:.1e}",
            str(level.degrees_of_freedom), level.engine,
        )
        for level in chart.model_levels
    ]  # fmt: skip
    return head, (1, 2), rows if len(rows) > 1 else []


def point_table(chart: ChartRecord) -> Table:
    """Table of all runs: head, indices of right-aligned columns, rows."""
    head = (
        "model", "method", "setting", "error", "CPU time", "runs", "steps", "evaluations",
        "factorizations", "note",
    )  # fmt: skip
    rows = [
        (
            p.model, p.method, str(p.setting), "" if p.error is None else f"{p.error:.2e}",
            "" if p.cpu_s is None else format_time(p.cpu_s), str(p.repeats or ""), _count(p.steps),
            _count(p.evaluations), _count(p.factorizations),
            p.failure or "; ".join(point_notes(p)),
        )
        for p in chart.points
    ]  # fmt: skip
    return head, (3, 4, 5, 6, 7, 8), rows


def point_notes(point: Point) -> list[str]:
    """Notes on a run: limited by the reference, warnings."""
    notes = [_LIMITED] if point.reference_limited else []
    return [*notes, *(f"warning: {text}" for text in point.warnings)]


def skip_reasons(entries: Iterable[Skipped], refused: bool, max_count: int = 1000) -> list[str]:
    """A sentence for each reason, with at most `max_count` of the methods that it applies to."""
    reasons: dict[str, dict[str, list[Skipped]]] = {}
    for entry in entries:
        if entry.is_unsupported == refused:
            reasons.setdefault(entry.reason, {}).setdefault(entry.method, []).append(entry)
    return [f"{_method_list(methods, max_count)}{reason}" for reason, methods in reasons.items()]


def _method_list(methods: Mapping[str, Sequence[Skipped]], max_count: int) -> str:
    """Methods with settings or number of levels, as in "rk4, step 1 s; auto (3 levels): "."""
    texts = []
    for method, entries in methods.items():
        models = [entry.model for entry in entries]
        settings = {entry.setting for entry in entries}
        parts = [method, *settings] if len(settings) == 1 else [method]
        text = ", ".join(part for part in parts if part) or ", ".join(models)
        texts.append(f"{text} ({len(models)} levels)" if method and len(models) > 1 else text)
    texts = [text for text in texts if text]
    if len(texts) > max_count:
        texts[max_count:] = [f"and {len(texts) - max_count} more"]
    return "; ".join(texts) + ": " if texts else ""


def format_time(seconds: float) -> str:
    """A time in s as text with a suitable unit: 0.00123 as "1.23 ms"."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def _unit(chart: ChartRecord) -> str:
    return "" if chart.reference.unit == "1" else f" {chart.reference.unit}"


def _count(number: int | None) -> str:
    return "" if number is None else str(number)
