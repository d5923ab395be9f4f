"""What a run says of itself, in plain words and tables."""

from __future__ import annotations

from collections.abc import Iterator
from math import log10
from typing import TYPE_CHECKING

from ...markup import bullets, folded, table, text

if TYPE_CHECKING:
    from ...runtime.result.result import Result
    from ...runtime.run.error_estimate import ErrorEstimate

#: Bodies and hinges that are listed one by one.
_LISTED = 200
#: Share of the motion from which on no digits are told, and digits beyond which none are counted.
_ONE_DIGIT, _MOST_DIGITS = 0.01, 12
#: Rows of loops that are listed.
_REPEATED = 12


def verdict(result: Result) -> str:
    """May the numbers be used, to how many digits, and until when?"""
    found = result.certificate.verdict()
    kind = "bad" if found.against else "good" if found.trusted else "open"
    words, _, reason = str(found).partition(": ")
    lines = [f"<p><b>{text(words[0].upper() + words[1:])}</b>: {text(reason)}.</p>"]
    lines += [f"<p>{text(sentence)}</p>" for sentence in _how_far(result)]
    reasons = bullets(found.against) if len(found.against) > 1 else ""
    return f'<div class="verdict {kind}">{"".join(lines)}{reasons}</div>'


def _how_far(result: Result) -> Iterator[str]:
    """To what error, and until when."""
    certificate, reached = result.certificate, result.error_estimate
    if reached is not None:
        yield f"Asked for an error: {reached}"
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
            f"From t = {until:.3g} s on accurate runs part: what comes "
            "later can be trusted as one possible motion, not as the one."
        )
    if error is not None or reached is not None:
        yield f"Looked at was {certificate.covers}."


def _digits(error: ErrorEstimate) -> str:
    """How many digits of coordinates that makes, beside how far they go."""
    shares = [value / error.moved.get(unit, 0.0) for unit, value in error.largest("q").items()
              if error.moved.get(unit, 0.0) > 0]  # fmt: skip
    worst = max(shares, default=0.0)
    if not shares or worst >= _ONE_DIGIT:
        return ""
    digits = _MOST_DIGITS if worst <= 10.0**-_MOST_DIGITS else int(-log10(worst))
    more = " or more" if digits == _MOST_DIGITS else ""
    return f", so that {digits} digits{more} of how far coordinates go can be used"


def made(result: Result) -> str:
    """How the run was made and what was chosen for it."""
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
    chosen = folded("What was chosen, when and why", bullets(stretches)) if stretches else ""
    return table(rows) + chosen + _models(result)


def _models(result: Result) -> str:
    """Levels of model of flexible bodies and what they leave out; what is packed otherwise."""
    rows = [
        (name, body.n, body.frame, "; ".join(body.notes) or "nothing")
        for name, body in result.model.flexible.items()
    ]
    head = ("flexible body", "shapes", "floating frame", "worth knowing")
    found = f'<div class="long">{table(rows, head)}</div>' if rows else ""
    if packed := [str(one) for one in result.model.simplifications]:
        found += folded("What is packed otherwise than the scene says it", bullets(packed))
    return f"<h3>What is simplified</h3>{found}" if found else ""


def mechanism(result: Result) -> str:
    """Bodies and hinges as lists."""
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
    """Where loops are cut, what they leave free, and which loads they leave open."""
    if result.model.closed is None:
        return ""
    loops = result.model.closed.loops
    rows = [
        ("loops closed by", ", ".join(loops.cut[:_REPEATED]) or "constraints and couplings"),
        ("rows that count", f"{loops.rank} of {len(loops.rows)}"),
        ("speeds left free", loops.mobility),
        ("rows that repeat others", loops.repeated(_REPEATED) or "none"),
        ("loads that are not determined", loops.open_loads or "none"),
    ]
    if loops.singular:
        rows.append(("the start", f"a singular pose: {loops.nearby} rows count nearby"))
    return "<h3>Closed loops</h3>" + table(rows)


def certificate(result: Result) -> str:
    """Every line of the certificate, and the risks with their remedies."""
    body = table(result.certificate.rows(verdict=False, warnings=False))
    risks = [(risk.element, risk.means, risk.remedy) for risk in result.risks]
    if risks:
        body += "<h3>What asks for attention</h3>" + table(risks, ("of", "what", "remedy"))
    return body


def provenance(result: Result) -> str:
    """Versions, hashes, and the scene with every default filled in."""
    from ...runtime.kernels.identity import kernels_hash
    from ...runtime.result.output.provenance import scene_hash, versions

    rows = [*versions().items(), ("scene, SHA-256", scene_hash(result)),
            ("kernels, SHA-256", kernels_hash(result.model.known))]  # fmt: skip
    scene = result.model.scene.to_toml()
    return table(rows) + folded("The scene", f"<pre>{text(scene)}</pre>")
