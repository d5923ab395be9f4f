"""Lines and tables of an advice for the terminal."""

from __future__ import annotations

from ..chart.tables import Table, format_time
from .advice import Advice


def summary_lines(advice: Advice) -> list[str]:
    """Summary of the advice in one or two lines."""
    unit = "" if advice.unit == "1" else f" {advice.unit}"
    target = (
        f"for an error of {advice.target_error:.2g}{unit} of {advice.measure}{advice.scaling_text}"
    )
    model = "a reduced scene" if advice.is_reduced else "the scene as it is"
    exceeded = "" if advice.error <= advice.target_error else ", LARGER than the target error"
    lines = [
        f"{target}: {model} by {advice.method}, {advice.setting}: error "
        f"{advice.error:.1e}{exceeded}, {format_time(advice.cpu_s)} CPU over "
        f"{advice.comparison_text}"
    ]
    savings = [
        _saving_text(
            "the model", advice.model_saving if advice.is_reduced else None, "the given scene"
        ),
        _saving_text("method and tolerance", advice.setting_saving, "the default ones"),
    ]
    text = ", ".join(saving for saving in savings if saving)
    return [*lines, *([text] if text else [])]


def _saving_text(cause: str, factor: float | None, other: str) -> str:
    if not factor:
        return ""
    if factor < 1:
        return f"{cause}: {1 / factor:.2g} times the time of {other}"
    return f"{cause}: a factor of {factor:.2g} faster than {other}"


def _factor_text(saving: float) -> str:
    """Effect of a choice on CPU time: factor saved or lost."""
    saved, lost = f"{saving:.2g}", f"{1 / saving:.2g}"
    if saved == "1" or lost == "1":
        return "the same"
    return f"saves a factor of {saved}" if saving > 1 else f"costs a factor of {lost}"


def body_table(advice: Advice) -> Table:
    """Advised model of each flexible body."""
    head = ("body", "given", "advised", "error of this choice", "time of this choice")
    rows = [
        (
            body.name, str(body.given_model), str(body.model),
            "" if body.error is None else f"{body.error:.1e}",
            "" if body.speedup is None else _factor_text(body.speedup),
        )
        for body in advice.bodies
    ]  # fmt: skip
    return head, (3, 4), rows


def trial_table(advice: Advice) -> Table:
    """All models that were tried."""
    head = ("model", "error", "CPU time", "note")
    rows = [
        (
            tried.name,
            "" if tried.error is None else f"{tried.error:.1e}",
            format_time(tried.cpu_s),
            tried.reason,
        )
        for tried in advice.tried_models
    ]
    return head, (1, 2), rows
