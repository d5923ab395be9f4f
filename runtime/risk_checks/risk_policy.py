"""`on_risk`: what a run does about its risks."""

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
    """What is seen before a run from (nq,), (nu,).

    Raises SceneError for a word that `on_risk` does not know, RiskRefused where that is "refuse"
    and something speaks against the run.
    """
    known = f"one of {', '.join(ON_RISK)}"
    if require_word("on_risk", on_risk, known) not in ON_RISK:
        raise SceneError(f"on_risk = {on_risk!r}: expected {known}")
    seen = check_before_run(model, settings, q, u)
    if on_risk == "refuse":
        step = check_step(model.looped, settings, q, u)
        own = () if step is None or step.risk is None else (step.risk,)
        _refuse((*model.scene.risks, *own, *seen.risks), "before the run")
    return seen if on_risk != "ignore" else replace(seen, told=False)


def apply_policy(result: Result, on_risk: str) -> Result:
    """The result of a run.

    Raises RiskRefused, which carries it, where `on_risk` is "refuse" and something speaks against
    the numbers of a run that reached its end.
    """
    if on_risk == "refuse" and result.success:
        try:
            risks = result.risks
        except KeyboardInterrupt as stopped:
            raise RiskRefused(
                'the run ended, but the look at its risks was interrupted (on_risk = "refuse")', [],
                result,
            ) from stopped  # fmt: skip
        _refuse(risks, "in what it gave", result)
    return result


def _refuse(risks: Iterable[Risk], where: str, result: Result | None = None) -> None:
    against = [risk for risk in risks if risk.doubt]
    if against:
        said = "\n".join(f"  {risk.name}: {risk}" for risk in against)
        raise RiskRefused(
            f'the run is refused (on_risk = "refuse") for what was seen {where}:\n{said}', against,
            result,
        )  # fmt: skip
