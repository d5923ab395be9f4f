"""Checks of answers about a state: equilibria, assemblies, linear models and their results.

Such an answer is checked as a run of zero duration, by the checks of runs; checks that only concern
linear models are in `runtime/linear/validity.py`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ..integrate.settings import Settings
from ..result.factory import result_of
from .driven_path import driven_states
from .pre_run import check_before_run

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

_STEPS = "an answer about a state takes no steps"
_TIME = "an answer about a state covers no time"

#: Risk of runs that does not apply to answers about a state -> reason.
NOT_APPLICABLE = {
    "step-stability": _STEPS,
    "step-accuracy": _STEPS,
    "stiff": _STEPS,
    "quaternion-length": _STEPS,
    "wanted-error": _STEPS,
    "narrow-load": _TIME,
    "pole": _TIME,
    "switches": _TIME,
    "chatter": _TIME,
    "energy-drift": _TIME,
    "momentum-drift": _TIME,
    "one-way-loads": _TIME,
    "one-way-blow": _TIME,
    "one-way-release": _TIME,
}


def find_state_risks(model: CompiledScene, t: float, q: Array, u: Array) -> tuple[Risk, ...]:
    """Find the risks of the state q (nq,), u (nu,) at t (s): of its models, sweep and loops."""
    settings = Settings(t, t)
    findings = check_before_run(model, settings, q, u)
    return result_of(
        model, findings.attach_to(driven_states(model, settings, q, u, [t]), q, u)
    ).risks


def merge_over_values(
    parameter: str, found: Sequence[tuple[float, Iterable[Risk]]]
) -> Iterator[Risk]:
    """Merge risks found over the values of a parameter: the worst of each kind and element.

    Its text states the value, and the number of other values with the same risk.
    """
    groups = dict[tuple[str, str], list[tuple[float, Risk]]]()
    for value, risks in found:
        for risk in risks:
            groups.setdefault((risk.name, risk.element), []).append((value, risk))
    for rows in groups.values():
        worst_value, worst = max(
            rows, key=lambda row: (row[1].invalidates, abs(row[1].value or 0.0))
        )
        others = len({value for value, _ in rows}) - 1
        where = f"at {parameter} = {worst_value:g}"
        where += f" and {others} other values" if others else ""
        yield replace(worst, description=f"{where}: {worst.description}")
