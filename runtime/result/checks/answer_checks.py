"""Risks of answers: of states, of values of a parameter, and the option `on_risk` of runs.

An answer about a state is an equilibrium, an assembly, a linear model or its result.  Its state is
checked as a run of zero duration, by the checks of runs; checks that only concern linear models are
in `runtime/linear/validity.py`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.argument_validation import require_word
from mstmm.array_validation import Array
from mstmm.errors import RiskRefused, SceneError
from mstmm.risk import ON_RISK, Risk

from ...integrate.settings import Settings
from ...run.step_stability import check_step
from ..one_way.result import result_of
from .check import RunStart, risks_of
from .run_checks import PreRunFindings, check_before_run

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ..result import Result


def find_state_risks(model: CompiledScene, t: float, q: Array, u: Array) -> tuple[Risk, ...]:
    """Find the risks of the state q (nq,), u (nu,) at t (s): of its models, sweep and loops."""
    start = RunStart(model, Settings(t, t), q, u)
    return result_of(model, check_before_run(start).attach_to(start.state)).risks


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


# --- reaction of a run ----------------------------------------------------------------------------


def check_start(start: RunStart, on_risk: str) -> PreRunFindings:
    """Check the start of a run.

    Raises SceneError for an unknown value of `on_risk`, RiskRefused if it is "refuse" and a risk is
    an objection.
    """
    options = f"one of {', '.join(ON_RISK)}"
    if require_word("on_risk", on_risk, options) not in ON_RISK:
        raise SceneError(f"on_risk = {on_risk!r}: expected {options}")
    findings = check_before_run(start)
    if on_risk == "refuse":
        step = check_step(start.model.looped, start.settings, start.q, start.u)
        risks = (*start.model.scene.risks, *risks_of(step), *findings.risks)
        _reject_objections(risks, "before the run")
    return findings if on_risk != "ignore" else replace(findings, risks_reported=False)


def apply_policy(result: Result, on_risk: str) -> Result:
    """Return the result of a run, unless `on_risk` rejects it.

    Raises RiskRefused, which carries the result, if `on_risk` is "refuse", the run has reached its
    end and a risk is an objection.
    """
    if on_risk == "refuse" and result.success:
        try:
            risks = result.risks
        except KeyboardInterrupt as stopped:
            raise RiskRefused(
                'run finished, but the check of its risks was interrupted (on_risk = "refuse")', [],
                result,
            ) from stopped  # fmt: skip
        _reject_objections(risks, "in the result", result)
    return result


def _reject_objections(risks: Iterable[Risk], where: str, result: Result | None = None) -> None:
    """Raise RiskRefused if one of the risks is an objection."""
    objections = [risk for risk in risks if risk.invalidates]
    if objections:
        rows = "\n".join(f"  {risk.name}: {risk}" for risk in objections)
        raise RiskRefused(
            f'run rejected (on_risk = "refuse"), risks found {where}:\n{rows}', objections, result
        )
