"""Sentences and tables of a report that summarise a run."""

from __future__ import annotations

from collections.abc import Iterator
from math import log10
from typing import TYPE_CHECKING

from ...display import bullets, collapsible, table, text

if TYPE_CHECKING:
    from ...runtime.result.result import Result
    from ...runtime.run.error_estimate import ErrorEstimate

#: Largest number of bodies and hinges in a list.
_MAX_LISTED = 200
#: Relative error from which on no digits are reported, and largest number of digits reported.
_MAX_ERROR_WITH_DIGITS, _MAX_DIGITS = 0.01, 12
#: Largest number of constraint rows in a list.
_MAX_LISTED_ROWS = 12


def verdict_html(result: Result) -> str:
    """HTML of the verdict: whether, to how many digits and until when the numbers are reliable."""
    verdict = result.certificate.verdict()
    kind = "bad" if verdict.objections else "good" if verdict.trusted else "open"
    parts, _, reason = str(verdict).partition(": ")
    lines = [f"<p><b>{text(parts[0].upper() + parts[1:])}</b>: {text(reason)}.</p>"]
    lines += [f"<p>{text(sentence)}</p>" for sentence in _error_sentences(result)]
    reasons = bullets(verdict.objections) if len(verdict.objections) > 1 else ""
    return f'<div class="verdict {kind}">{"".join(lines)}{reasons}</div>'


def _error_sentences(result: Result) -> Iterator[str]:
    """Sentences on the size of the error, and until when it applies."""
    certificate, estimate = result.certificate, result.achieved_error
    if estimate is not None:
        yield f"Target error: {estimate}"
    error, predictable_until = certificate.error, certificate.predictable_until
    if error is not None:
        end = float(result.t[-1]) if predictable_until is None else predictable_until
        units = ", ".join(f"{v:.1e} {u or '1'}" for u, v in error.largest("q").items())
        yield (
            f"Up to t = {end:.4g} s a second, more accurate run differs by at most {units}"
            f"{_digits_clause(error)}."
        )
    if predictable_until is not None:
        yield (
            f"From t = {predictable_until:.3g} s on accurate runs diverge: later values are one "
            "possible motion, but no prediction."
        )
    if error is not None or estimate is not None:
        yield f"The error refers to {certificate.error_scope}."


def _digits_clause(error: ErrorEstimate) -> str:
    """Clause with the number of reliable digits of coordinates, relative to their excursion."""
    shares = [value / error.excursion.get(unit, 0.0) for unit, value in error.largest("q").items()
              if error.excursion.get(unit, 0.0) > 0]  # fmt: skip
    largest_share = max(shares, default=0.0)
    if not shares or largest_share >= _MAX_ERROR_WITH_DIGITS:
        return ""
    digits = _MAX_DIGITS if largest_share <= 10.0**-_MAX_DIGITS else int(-log10(largest_share))
    suffix = " or more" if digits == _MAX_DIGITS else ""
    return f", which is {digits} digits{suffix} of the largest excursion of coordinates"


def settings_html(result: Result) -> str:
    """HTML of the settings of a run, and of the choices made for it."""
    settings, statistics, model = result.settings, result.statistics, result.model
    accuracy = f"step {settings.step:g} s" if settings.step is not None else (
        f"rtol {settings.rtol:g}, atol {settings.atol:g}"
    )  # fmt: skip
    rows = [
        ("time", f"{settings.t_start:g} to {settings.t_end:g} s, {len(result.t)} samples"),
        ("outcome", result.message), ("method", f"{settings.method}, {accuracy}"),
        ("engine", model.engine_reason or model.engine), ("sweep", model.sweep),
    ]  # fmt: skip
    if statistics is not None:
        rows.append(("steps", f"{statistics.steps}, {statistics.rejected_steps} rejected"))
        rows.append(("evaluations", f"{statistics.evaluations}"))
    method_texts = [str(stretch) for stretch in result.method_history]
    choices = (
        collapsible("Methods chosen, with time and reason", bullets(method_texts))
        if method_texts
        else ""
    )
    return table(rows) + choices + _simplifications_html(result)


def _simplifications_html(result: Result) -> str:
    """HTML of model levels of flexible bodies with their limits, and of simplifications."""
    rows = [
        (name, body.n, body.frame, "; ".join(body.notes) or "nothing")
        for name, body in result.model.flexible_bodies.items()
    ]
    head = ("flexible body", "shapes", "floating frame", "notes")
    html = f'<div class="long">{table(rows, head)}</div>' if rows else ""
    if simplifications := [str(simplification) for simplification in result.model.simplifications]:
        html += collapsible(
            "Simplifications of the scene before compilation", bullets(simplifications)
        )
    return f"<h3>Simplifications</h3>{html}" if html else ""


def mechanism_html(result: Result) -> str:
    """HTML lists of bodies and hinges, and of closed loops."""
    scene = result.model.scene
    hinges = [
        (hinge.name, hinge.type, hinge.inboard, hinge.outboard)
        for hinge in list(scene.hinges[:_MAX_LISTED])
    ]
    bodies = [
        (
            body.name,
            "flexible" if body.name in result.model.flexible_bodies else f"{body.mass:g} kg",
            ", ".join(body.ends) or "none",
        )
        for body in list(scene.skeleton.bodies[:_MAX_LISTED])
    ]
    count = f"{len(scene.skeleton.bodies)} bodies, {len(scene.hinges)} hinges"
    lists = table(hinges, ("hinge", "type", "inboard", "outboard"))
    lists += "<p></p>" + table(bodies, ("body", "mass", "ends"))
    return collapsible(count, lists) + _loops_html(result)


def _loops_html(result: Result) -> str:
    """HTML of closed loops: cut hinges, rank, mobility and indeterminate loads."""
    if result.model.loop_start is None:
        return ""
    loops = result.model.loop_start.loops
    rows = [
        (
            "loops closed by",
            ", ".join(loops.cut_hinges[:_MAX_LISTED_ROWS]) or "constraints and couplings",
        ),
        ("independent rows", f"{loops.rank} of {len(loops.constraint_rows)}"),
        ("mobility", loops.mobility),
        ("redundant rows", loops.redundant_text(_MAX_LISTED_ROWS) or "none"),
        ("indeterminate loads", loops.indeterminate_text or "none"),
    ]
    if loops.singular:
        rows.append(
            ("start", f"singular configuration: {loops.generic_rank} independent rows nearby")
        )
    return "<h3>Closed loops</h3>" + table(rows)


def certificate_html(result: Result) -> str:
    """HTML of all lines of the certificate, and of the risks with their remedies."""
    body = table(result.certificate.as_pairs(verdict=False, warnings=False))
    risks = [(risk.element, risk.description, risk.remedy) for risk in result.risks]
    if risks:
        body += "<h3>Risks</h3>" + table(risks, ("element", "finding", "remedy"))
    return body


def provenance_html(result: Result) -> str:
    """HTML of versions, hashes, and the scene with every default filled in."""
    from mstmm.runtime.kernels.prebuilt_kernels import kernels_hash

    from ...runtime.result.export.provenance import program_versions, scene_hash

    rows = [*program_versions().items(), ("scene, SHA-256", scene_hash(result)),
            ("kernels, SHA-256", kernels_hash(result.model.known))]  # fmt: skip
    scene = result.model.scene.to_toml()
    return table(rows) + collapsible("The scene", f"<pre>{text(scene)}</pre>")
