"""What an advice says in lines and tables on the terminal."""

from __future__ import annotations

from ..chart.tables import Table, format_time
from .advice import Advice


def summary(advice: Advice) -> list[str]:
    """The advice in a few lines."""
    unit = "" if advice.unit == "1" else f" {advice.unit}"
    asked = f"for an error of {advice.asked:.2g}{unit} of {advice.measure}{advice.in_words}"
    met = "" if advice.error <= advice.asked else ", MORE than was asked"
    lines = [
        f"{asked}: {_model(advice)} by {advice.method}, {advice.setting}: error "
        f"{advice.error:.1e}{met}, {format_time(advice.cpu_s)} CPU over {advice.compared}",
    ]
    savings = [
        _saved("the model", advice.model_saving if advice.reduced else None, "the given scene"),
        _saved("method and tolerance", advice.setting_saving, "the default ones"),
    ]
    told = ", ".join(text for text in savings if text)
    return [*lines, *([told] if told else [])]


def _saved(what: str, factor: float | None, other: str) -> str:
    if not factor:
        return ""
    if factor < 1:
        return f"{1 / factor:.2g} times the time of {other} by {what}"
    return f"a factor of {factor:.2g} less time than {other} by {what}"


def _factor(saving: float) -> str:
    """A factor of the time saved, or of what a choice costs where it saves nothing."""
    saved, cost = f"{saving:.2g}", f"{1 / saving:.2g}"
    if saved == "1" or cost == "1":
        return "the same"
    return f"saves a factor of {saved}" if saving > 1 else f"costs a factor of {cost}"


def _model(advice: Advice) -> str:
    if not advice.reduced:
        return "the scene as it is"
    return "a reduced scene"


def bodies(advice: Advice) -> Table:
    """The choice for each flexible body."""
    head = ("body", "given", "advised", "error of this alone", "time of this alone")
    rows = [
        (
            one.name, str(one.given), str(one.choice),
            "" if one.error is None else f"{one.error:.1e}",
            "" if one.saving is None else _factor(one.saving),
        )
        for one in advice.bodies
    ]  # fmt: skip
    return head, (3, 4), rows


def trial_table(advice: Advice) -> Table:
    """Every model that was run."""
    head = ("model", "error", "CPU time", "note")
    rows = [
        (one.name, "" if one.error is None else f"{one.error:.1e}", format_time(one.cpu_s), one.why)
        for one in advice.tried
    ]
    return head, (1, 2), rows
