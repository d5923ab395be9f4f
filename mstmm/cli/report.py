"""What a run says about itself: on the terminal as lines, for machines as a dictionary."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mstmm.runtime.result import Result


def sizes(result: Result) -> str:
    """3 bodies on 3 hinges, 9 degrees of freedom."""
    scene = result.model.scene
    return (
        f"{count(len(scene.body), 'body', 'bodies')} on {count(len(scene.hinge), 'hinge')}, "
        f"{count(result.model.nu, 'degree')} of freedom"
    )


def count(n: int, one: str, many: str = "") -> str:
    """3 bodies, 1 body."""
    return f"{n} {one if n == 1 else many or one + 's'}"


def effort(result: Result, seconds: float) -> str:
    """Method, tolerances, steps and time of a run."""
    s = result.settings
    how = f"step {s.step:g} s" if s.step is not None else f"rtol {s.rtol:g}, atol {s.atol:g}"
    parts = [f"{s.method}, {how}"]
    counted = result.statistics
    if counted is not None:
        rejected = f" ({counted.rejected} rejected)" if counted.rejected else ""
        parts.append(f"{count(counted.steps, 'step')}{rejected}")
        parts.append(count(counted.evaluations, "evaluation"))
    parts.append(f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s")
    return ": ".join([parts[0], ", ".join(parts[1:])])


def fitting_table(result: Result, names: tuple[str, ...], rows: int, width: int) -> str:
    """Some samples; columns that nobody asked for are left out where the terminal is narrow."""
    if names:
        return result.table(*names, rows=rows)
    from mstmm.runtime.table import default_names

    chosen = [*default_names(result), "energy"]
    text = result.table(*chosen, rows=rows)
    while len(chosen) > 1 and max(map(len, text.splitlines())) > width:
        del chosen[-2]
        text = result.table(*chosen, rows=rows)
    return text


def to_json(result: Result, seconds: float) -> dict[str, Any]:
    """The outcome of a run without its samples, which are in the file."""
    layout = result.model.layout
    last = len(result.t) - 1
    counted = result.statistics
    return {
        "success": result.success,
        "status": "interrupted" if result.status is None else result.status.name.lower(),
        "message": result.message,
        "t": float(result.t[last]) if last >= 0 else None,
        "samples": last + 1,
        "q": dict(zip(layout.q_names, result.q[last].tolist(), strict=True)) if last >= 0 else {},
        "u": dict(zip(layout.u_names, result.u[last].tolist(), strict=True)) if last >= 0 else {},
        "method": result.settings.method,
        "seconds": seconds,
        "statistics": None if counted is None else asdict(counted),
        "warnings": list(result.warnings),
    }
