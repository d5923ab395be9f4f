"""Summary of a run: lines for the terminal, and a dictionary for JSON."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

from mstmm.plain_data import stored_keys, to_plain
from mstmm.risk import to_rows

if TYPE_CHECKING:
    from mstmm.runtime.result.certificate import Verdict
    from mstmm.runtime.result.result import Result

#: Largest number of time spans with one method that are listed individually.
_MAX_LISTED_SPANS = 6


def size_text(result: Result) -> str:
    """Size of the scene: "3 bodies on 3 hinges, 7 degrees of freedom, 2 driven"."""

    model, bodies = result.model, len(result.model.scene.skeleton.bodies)
    free_count, driven_count = len(model.free_speed_indices), len(model.packed_scene.system.driven)
    locked_count = model.nu - free_count - driven_count
    if model.loop_start is not None:  # loops reduce the mobility of all speeds together
        free_count, locked_count = model.loop_start.loops.mobility, 0
    parts = [
        f"{count_text(bodies, 'body', 'bodies')} on {count_text(len(model.scene.hinges), 'hinge')}",
        f"{count_text(free_count, 'degree')} of freedom",
        *([f"{driven_count} driven"] if driven_count else []),
        *([f"{locked_count} locked until released"] if locked_count else []),
    ]
    return ", ".join(parts)


def simplification_counts(result: Result) -> str:
    """Numbers of simplifications of the scene; empty if there are none."""
    from mstmm.runtime.packing.simplification import COUNT_TEXTS

    kinds = [singular.kind for singular in result.model.simplifications]
    return "; ".join(
        f"{count_text(kinds.count(kind), singular, plural)} {description}"
        for kind, (singular, plural, description) in COUNT_TEXTS.items() if kind in kinds
    )  # fmt: skip


def engine_text(result: Result) -> str:
    """Engine of a run, and its sweep unless that is "riccati"."""
    model = result.model
    return f"{model.engine} engine" + (f", sweep {model.sweep}" if model.sweep != "riccati" else "")


def count_text(n: int, one: str, many: str = "") -> str:
    """Number with its noun in singular or plural: "3 bodies", "1 body"."""
    return f"{n} {one if n == 1 else many or one + 's'}"


def effort_text(result: Result, seconds: float) -> str:
    """Method, tolerances, steps and duration of a run."""
    s = result.settings
    accuracy = f"step {s.step:g} s" if s.step is not None else f"rtol {s.rtol:g}, atol {s.atol:g}"
    parts = [f"{s.method}, {accuracy}"]
    statistics = result.statistics
    if statistics is not None:
        parts.append(count_text(statistics.steps, "step"))
        parts.append(count_text(statistics.evaluations, "evaluation"))
        if statistics.residuals:
            parts.append(count_text(statistics.residuals, "residual"))
    parts.append(f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s")
    return ": ".join([parts[0], ", ".join(parts[1:])])


def method_lines(result: Result, width: int) -> list[str]:
    """Lines with the methods of a run; for many time spans, the total time of each method."""
    spans = result.method_history
    if not spans:
        return []
    if len(spans) <= _MAX_LISTED_SPANS:
        return [part for span in spans for part in _wrap(f"  {span}", width)]
    ends = [*(span.t for span in spans[1:]), result.last_state[0]]
    times: dict[str, float] = {}
    for span, end in zip(spans, ends, strict=True):
        times[span.method] = times.get(span.method, 0.0) + end - span.t
    shares = ", ".join(f"{name} {time:.4g} s" for name, time in times.items())
    return _wrap(f"  in {len(spans)} time spans: {shares}", width)


def fitting_table(result: Result, names: tuple[str, ...], rows: int, width: int) -> str:
    """Table of some samples; on a narrow terminal default columns are left out."""
    from mstmm.runtime.result.export.column_files import default_names

    pictures = result.picture_names()
    numeric_names = [name for name in names if name not in pictures]
    if numeric_names:
        return result.table(*numeric_names, rows=rows)
    columns = [*default_names(result), "energy"]
    text = result.table(*columns, rows=rows)
    while len(columns) > 1 and max(map(len, text.splitlines())) > width:
        del columns[-2]
        text = result.table(*columns, rows=rows)
    return text


def to_json(result: Result, seconds: float, verdict: Verdict) -> dict[str, Any]:
    """Result of a run as plain data, without its samples, which are in the file."""
    layout = result.model.coordinate_layout
    last_index = len(result.t) - 1
    statistics, estimate = result.statistics, result.achieved_error
    outputs = result.outputs() if last_index >= 0 else {}
    return {
        "success": result.success,
        "trusted": verdict.trusted,
        "verdict": str(verdict),
        "status": "interrupted" if result.status is None else result.status.name.lower(),
        "message": result.message,
        "t": float(result.t[last_index]) if last_index >= 0 else None,
        "samples": last_index + 1,
        "q": dict(zip(layout.q_names, result.q[last_index].tolist(), strict=True))
        if last_index >= 0
        else {},
        "u": dict(zip(layout.u_names, result.u[last_index].tolist(), strict=True))
        if last_index >= 0
        else {},
        "outputs": {name: values[last_index].tolist() for name, values in outputs.items()},
        "method": result.settings.method,
        "methods": to_plain(result.method_history),
        "simplifications": to_plain(result.model.simplifications),
        "engine": result.model.engine,
        "engine_choice": result.model.engine_reason,
        "sweep": result.model.sweep,
        "seconds": seconds,
        "statistics": to_plain(statistics),
        "error_estimate": None if estimate is None else estimate.to_dict(),
        "risks": to_rows(result.risks),
        "warnings": list(result.warnings),
        "certificate": _certificate_data(result),
    }


def _certificate_data(result: Result) -> dict[str, Any]:
    """Certificate as plain data; the estimated error by unit."""
    certificate = result.certificate
    excluded = ("error", "reached", "control")  # reported elsewhere
    plain = {
        key: to_plain(getattr(certificate, name))
        for name, key in stored_keys(certificate).items()
        if key not in excluded
    }
    error = certificate.error
    if error is None:
        return {**plain, "error": None}
    return {
        **plain,
        "error": {
            "q": error.largest("q"), "u": error.largest("u"), "until": error.divergence_time,
            "covered": error.covered,
            "tenfold_every": error.tenfold_time, "reference": error.reference,
        },
    }  # fmt: skip


def verdict_lines(verdict: Verdict, width: int, has_reasons: bool = True) -> list[str]:
    """Verdict, wrapped to the width of the terminal; `has_reasons`: its reasons are printed too."""
    text = str(verdict).replace("certify=True", "--certify")
    return textwrap.wrap(text if has_reasons else text.replace(", see below", ""), max(width, 40))


def certificate_lines(result: Result, width: int) -> list[str]:
    """Certificate and all warnings of a result, wrapped to the width of the terminal."""
    certificate = result.certificate
    text = certificate.as_text(verdict=False, warnings=result.trajectory.reported_risks)
    lines = text.replace("certify=True", "--certify").splitlines()
    other_warnings = [w for w in result.warnings if w not in certificate.warnings]
    lines += [f"note: {warning}" for warning in other_warnings]
    return [part for line in lines for part in _wrap(line, width)]


def _wrap(line: str, width: int) -> list[str]:
    """Wrap a line; continuation lines are indented to the text after the name of the row."""
    name = line.split("  ", 1)[0]
    indent = len(line) - len(line[len(name) :].lstrip())
    return textwrap.wrap(
        line, max(width, 40), subsequent_indent=" " * min(indent, 30),
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
