"""Summary of a run: lines for the terminal, and a dictionary for JSON."""

from __future__ import annotations

import textwrap
from dataclasses import asdict, fields, is_dataclass
from typing import TYPE_CHECKING, Any

from mstmm.risk import to_rows

if TYPE_CHECKING:
    from mstmm.runtime.result.result import Result
    from mstmm.runtime.result.verdict import Verdict

#: Largest number of time spans with one method that are listed individually.
_STRETCHES = 6


def sizes(result: Result) -> str:
    """Size of the scene: "3 bodies on 3 hinges, 7 degrees of freedom, 2 driven"."""

    model, bodies = result.model, len(result.model.scene.skeleton.bodies)
    free, driven = len(model.free_speeds), len(model.packed.system.driven)
    held = model.nu - free - driven
    if model.closed is not None:  # loops reduce the mobility of all speeds together
        free, held = model.closed.loops.mobility, 0
    parts = [
        f"{count(bodies, 'body', 'bodies')} on {count(len(model.scene.hinges), 'hinge')}",
        f"{count(free, 'degree')} of freedom",
        *([f"{driven} driven"] if driven else []),
        *([f"{held} locked until released"] if held else []),
    ]
    return ", ".join(parts)


def simplified(result: Result) -> str:
    """Numbers of simplifications of the scene; empty if there are none."""
    from mstmm.runtime.pack.merge.simplification import COUNTED

    kinds = [one.kind for one in result.model.simplifications]
    return "; ".join(
        f"{count(kinds.count(kind), one, many)} {what}"
        for kind, (one, many, what) in COUNTED.items() if kind in kinds
    )  # fmt: skip


def engine(result: Result) -> str:
    """Engine of a run, and its sweep unless that is "riccati"."""
    model = result.model
    return f"{model.engine} engine" + (f", sweep {model.sweep}" if model.sweep != "riccati" else "")


def count(n: int, one: str, many: str = "") -> str:
    """Number with its noun in singular or plural: "3 bodies", "1 body"."""
    return f"{n} {one if n == 1 else many or one + 's'}"


def effort(result: Result, seconds: float) -> str:
    """Method, tolerances, steps and duration of a run."""
    s = result.settings
    how = f"step {s.step:g} s" if s.step is not None else f"rtol {s.rtol:g}, atol {s.atol:g}"
    parts = [f"{s.method}, {how}"]
    counted = result.statistics
    if counted is not None:
        parts.append(count(counted.steps, "step"))
        parts.append(count(counted.evaluations, "evaluation"))
        if counted.residuals:
            parts.append(count(counted.residuals, "residual"))
    parts.append(f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s")
    return ": ".join([parts[0], ", ".join(parts[1:])])


def method_lines(result: Result, width: int) -> list[str]:
    """Lines with the methods of a run; for many time spans, the total time of each method."""
    stretches = result.methods
    if not stretches:
        return []
    if len(stretches) <= _STRETCHES:
        return [part for stretch in stretches for part in _folded(f"  {stretch}", width)]
    ends = [*(stretch.t for stretch in stretches[1:]), result.last_state[0]]
    times: dict[str, float] = {}
    for stretch, end in zip(stretches, ends, strict=True):
        times[stretch.method] = times.get(stretch.method, 0.0) + end - stretch.t
    shares = ", ".join(f"{name} {time:.4g} s" for name, time in times.items())
    return _folded(f"  in {len(stretches)} time spans: {shares}", width)


def fitting_table(result: Result, names: tuple[str, ...], rows: int, width: int) -> str:
    """Table of some samples; on a narrow terminal default columns are left out."""
    from mstmm.runtime.result.output.table import default_names

    pictures = result.pictures()
    numbers = [name for name in names if name not in pictures]
    if numbers:
        return result.table(*numbers, rows=rows)
    chosen = [*default_names(result), "energy"]
    text = result.table(*chosen, rows=rows)
    while len(chosen) > 1 and max(map(len, text.splitlines())) > width:
        del chosen[-2]
        text = result.table(*chosen, rows=rows)
    return text


def to_json(result: Result, seconds: float, verdict: Verdict) -> dict[str, Any]:
    """Result of a run as plain data, without its samples, which are in the file."""
    layout = result.model.layout
    last = len(result.t) - 1
    counted, reached = result.statistics, result.error_estimate
    outputs = result.outputs() if last >= 0 else {}
    return {
        "success": result.success,
        "trusted": verdict.trusted,
        "verdict": str(verdict),
        "status": "interrupted" if result.status is None else result.status.name.lower(),
        "message": result.message,
        "t": float(result.t[last]) if last >= 0 else None,
        "samples": last + 1,
        "q": dict(zip(layout.q_names, result.q[last].tolist(), strict=True)) if last >= 0 else {},
        "u": dict(zip(layout.u_names, result.u[last].tolist(), strict=True)) if last >= 0 else {},
        "outputs": {name: values[last].tolist() for name, values in outputs.items()},
        "method": result.settings.method,
        "methods": [asdict(stretch) for stretch in result.methods],
        "simplifications": [asdict(one) for one in result.model.simplifications],
        "engine": result.model.engine,
        "engine_choice": result.model.engine_choice,
        "sweep": result.model.sweep,
        "seconds": seconds,
        "statistics": None if counted is None else asdict(counted),
        "error_estimate": None if reached is None else reached.to_dict(),
        "risks": to_rows(result.risks),
        "warnings": list(result.warnings),
        "certificate": _certificate(result),
    }


def _certificate(result: Result) -> dict[str, Any]:
    """Certificate as plain data; the estimated error by unit."""
    certificate = result.certificate
    told = ("error", "reached", "models", "known", "control")  # in other rows
    data = {f.name: getattr(certificate, f.name) for f in fields(certificate) if f.name not in told}
    plain = {key: vars(v) if is_dataclass(v) else v for key, v in data.items()}
    plain["risks"] = to_rows(certificate.risks)
    plain["momentum"] = [vars(drift) for drift in certificate.momentum]
    plain["flexible"] = [vars(body) for body in certificate.flexible]
    error = certificate.error
    if error is None:
        return {**plain, "error": None}
    return {
        **plain,
        "error": {
            "q": error.largest("q"), "u": error.largest("u"), "until": error.horizon,
            "covered": error.covered,
            "tenfold_every": error.tenfold, "reference": error.reference,
        },
    }  # fmt: skip


def verdict_lines(verdict: Verdict, width: int, told: bool = True) -> list[str]:
    """Verdict, wrapped to the width of the terminal; `told`: its reasons are printed too."""
    text = str(verdict).replace("certify=True", "--certify")
    return textwrap.wrap(text if told else text.replace(", see below", ""), max(width, 40))


def certificate_lines(result: Result, width: int) -> list[str]:
    """Certificate and all warnings of a result, wrapped to the width of the terminal."""
    certificate = result.certificate
    told = certificate.text(verdict=False, warnings=result.trajectory.told)
    lines = told.replace("certify=True", "--certify").splitlines()
    found = [w for w in result.warnings if w not in certificate.warnings]
    lines += [f"note: {warning}" for warning in found]
    return [part for line in lines for part in _folded(line, width)]


def _folded(line: str, width: int) -> list[str]:
    """Wrap a line; continuation lines are indented to the text after the name of the row."""
    name = line.split("  ", 1)[0]
    indent = len(line) - len(line[len(name) :].lstrip())
    return textwrap.wrap(
        line, max(width, 40), subsequent_indent=" " * min(indent, 30),
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
