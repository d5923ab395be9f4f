"""Sentences and tables of a report that summarise a run."""

from __future__ import annotations

from collections.abc import Iterator
from math import log10
from typing import TYPE_CHECKING

from ...markup import bullets, folded, table, text

if TYPE_CHECKING:
    from ...runtime.result.result import Result
    from ...runtime.run.error_estimate import ErrorEstimate

#: Largest number of bodies and hinges in a list.
_LISTED = 200
#: Relative error from which on no digits are reported, and largest number of digits reported.
_ONE_DIGIT, _MOST_DIGITS = 0.01, 12
#: Largest number of constraint rows in a list.
_REPEATED = 12


def verdict(result: Result) -> str:
    """HTML of the verdict: whether, to how many digits and until when the numbers are reliable."""
    found = result.certificate.verdict()
    kind = "bad" if found.against else "good" if found.trusted else "open"
    words, _, reason = str(found).partition(": ")
    lines = [f"<p><b>{text(words[0].upper() + words[1:])}</b>: {text(reason)}.</p>"]
    lines += [f"<p>{text(sentence)}</p>" for sentence in _how_far(result)]
    reasons = bullets(found.against) if len(found.against) > 1 else ""
    return f'<div class="verdict {kind}">{"".join(lines)}{reasons}</div>'


def _how_far(result: Result) -> Iterator[str]:
    """Sentences on the size of the error, and until when it applies."""
    certificate, reached = result.certificate, result.error_estimate
    if reached is not None:
        yield f"Target error: {reached}"
    error, until = certificate.error, certificate.predictable_until
    if error is not None:
        end = float(result.t[-1]) if until is None else until
        units = ", ".join(f"{v:.1e} {u or '1'}" for u, v in error.largest("q").items())
        yield (
            f"Up to t = {end:.4g} s a second, more accurate run differs by at most {units}"
            f"{_digits(error)}."
        )
    if until is not None:
        yield (
            f"From t = {until:.3g} s on accurate runs diverge: later values are one possible "
            "motion, but no prediction."
        )
    if error is not None or reached is not None:
        yield f"The error refers to {certificate.covers}."


def _digits(error: ErrorEstimate) -> str:
    """Clause with the number of reliable digits of coordinates, relative to their excursion."""
    shares = [value / error.moved.get(unit, 0.0) for unit, value in error.largest("q").items()
              if error.moved.get(unit, 0.0) > 0]  # fmt: skip
    worst = max(shares, default=0.0)
    if not shares or worst >= _ONE_DIGIT:
        return ""
    digits = _MOST_DIGITS if worst <= 10.0**-_MOST_DIGITS else int(-log10(worst))
    more = " or more" if digits == _MOST_DIGITS else ""
    return f", which is {digits} digits{more} of the largest excursion of coordinates"


def made(result: Result) -> str:
    """HTML of the settings of a run, and of the choices made for it."""
    settings, counted, model = result.settings, result.statistics, result.model
    by = f"step {settings.step:g} s" if settings.step is not None else (
        f"rtol {settings.rtol:g}, atol {settings.atol:g}"
    )  # fmt: skip
    rows = [
        ("time", f"{settings.t_start:g} to {settings.t_end:g} s, {len(result.t)} samples"),
        ("outcome", result.message), ("method", f"{settings.method}, {by}"),
        ("engine", model.engine_choice or model.engine), ("sweep", model.sweep),
    ]  # fmt: skip
    if counted is not None:
        rows.append(("steps", f"{counted.steps}, {counted.rejected} rejected"))
        rows.append(("evaluations", f"{counted.evaluations}"))
    stretches = [str(stretch) for stretch in result.methods]
    chosen = folded("Methods chosen, with time and reason", bullets(stretches)) if stretches else ""
    return table(rows) + chosen + _models(result)


def _models(result: Result) -> str:
    """HTML of model levels of flexible bodies with their limits, and of simplifications."""
    rows = [
        (name, body.n, body.frame, "; ".join(body.notes) or "nothing")
        for name, body in result.model.flexible.items()
    ]
    head = ("flexible body", "shapes", "floating frame", "notes")
    found = f'<div class="long">{table(rows, head)}</div>' if rows else ""
    if packed := [str(one) for one in result.model.simplifications]:
        found += folded("Simplifications of the scene before compilation", bullets(packed))
    return f"<h3>Simplifications</h3>{found}" if found else ""


def mechanism(result: Result) -> str:
    """HTML lists of bodies and hinges, and of closed loops."""
    scene = result.model.scene
    joined = [
        (hinge.name, hinge.type, hinge.inboard, hinge.outboard)
        for hinge in list(scene.hinges[:_LISTED])
    ]
    bodies = [
        (body.name, "flexible" if body.name in result.model.flexible else f"{body.mass:g} kg",
         ", ".join(body.ends) or "none")
        for body in list(scene.skeleton.bodies[:_LISTED])
    ]  # fmt: skip
    count = f"{len(scene.skeleton.bodies)} bodies, {len(scene.hinges)} hinges"
    lists = table(joined, ("hinge", "type", "inboard", "outboard"))
    lists += "<p></p>" + table(bodies, ("body", "mass", "ends"))
    return folded(count, lists) + _loops(result)


def _loops(result: Result) -> str:
    """HTML of closed loops: cut hinges, rank, mobility and indeterminate loads."""
    if result.model.closed is None:
        return ""
    loops = result.model.closed.loops
    rows = [
        ("loops closed by", ", ".join(loops.cut[:_REPEATED]) or "constraints and couplings"),
        ("independent rows", f"{loops.rank} of {len(loops.rows)}"),
        ("mobility", loops.mobility),
        ("redundant rows", loops.repeated(_REPEATED) or "none"),
        ("indeterminate loads", loops.open_loads or "none"),
    ]
    if loops.singular:
        rows.append(("start", f"singular configuration: {loops.nearby} independent rows nearby"))
    return "<h3>Closed loops</h3>" + table(rows)


def certificate(result: Result) -> str:
    """HTML of all lines of the certificate, and of the risks with their remedies."""
    body = table(result.certificate.rows(verdict=False, warnings=False))
    risks = [(risk.element, risk.means, risk.remedy) for risk in result.risks]
    if risks:
        body += "<h3>Risks</h3>" + table(risks, ("element", "finding", "remedy"))
    return body


def provenance(result: Result) -> str:
    """HTML of versions, hashes, and the scene with every default filled in."""
    from ...runtime.kernels.identity import kernels_hash
    from ...runtime.result.output.provenance import scene_hash, versions

    rows = [*versions().items(), ("scene, SHA-256", scene_hash(result)),
            ("kernels, SHA-256", kernels_hash(result.model.known))]  # fmt: skip
    scene = result.model.scene.to_toml()
    return table(rows) + folded("The scene", f"<pre>{text(scene)}</pre>")
