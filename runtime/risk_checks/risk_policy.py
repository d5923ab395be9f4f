"""Option `on_risk`: the reaction of a run to its risks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.argument_validation import require_word
from mstmm.array_validation import Array
from mstmm.errors import RiskRefused, SceneError
from mstmm.risk import ON_RISK, Risk

from ..run.step_stability import check_step
from .pre_run import PreRunFindings, check_before_run

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings
    from ..result.result import Result


def check_start(
    model: CompiledScene, settings: Settings, q: Array, u: Array, on_risk: str
) -> PreRunFindings:
    """Check the start of a run from q (nq,), u (nu,).

    Raises SceneError for an unknown value of `on_risk`, RiskRefused if it is "refuse" and a risk is
    an objection.
    """
    options = f"one of {', '.join(ON_RISK)}"
    if require_word("on_risk", on_risk, options) not in ON_RISK:
        raise SceneError(f"on_risk = {on_risk!r}: expected {options}")
    findings = check_before_run(model, settings, q, u)
    if on_risk == "refuse":
        step = check_step(model.looped, settings, q, u)
        step_risks = () if step is None or step.risk is None else (step.risk,)
        _reject_objections((*model.scene.risks, *step_risks, *findings.risks), "before the run")
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
