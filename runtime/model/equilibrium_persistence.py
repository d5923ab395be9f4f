"""Check whether an equilibrium lasts while drives move and loads change with time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import NumericalFailure, SceneError
from mstmm.risk import DeferredRisks, Risk, information

from ..linear.operating_point.departure import find_departure
from ..linear.operating_point.later_states import LaterStates
from ..linear.validity import departure_risk
from ..run.scene_system import SceneSystem

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..linear.linear_model import Linear
    from .equilibrium import Equilibrium


def with_persistence_findings(
    model: CompiledScene, equilibrium: Equilibrium, t: float, linearise: Callable[[], Linear]
) -> Equilibrium:
    """Equilibrium at t (s), with a finding if it does not last.

    `linearise` returns the linear model about it.  Raises NumericalFailure if moving drives do not
    keep it at rest.
    """
    if model.packed_scene.system.is_autonomous or not len(equilibrium.residuals):
        return equilibrium
    earlier = equilibrium.findings
    if not _drives_move(model, equilibrium, t):
        equilibrium.findings = DeferredRisks(lambda: (*earlier, *_risks(t, linearise)))
        return equilibrium
    risks = tuple(_risks(t, linearise))
    for risk in risks:
        if risk.invalidates:
            raise NumericalFailure(
                f"no equilibrium: {risk.description}; simulate the motion, or stop the drives"
            )
    equilibrium.findings = (*earlier, *risks)
    return equilibrium


def _drives_move(model: CompiledScene, equilibrium: Equilibrium, t: float) -> bool:
    """Whether any drive has a speed or an acceleration at t (s)."""
    system, engine = model.packed_scene.system, model.looped
    y = SceneSystem(engine).start(t, np.asarray(equilibrium), np.zeros(model.nu))
    q, u = y[None, : model.nq].copy(), y[None, model.nq : model.nq + model.nu].copy()
    _, a = engine.accelerations(t, q, u, engine.start_memory()[None])
    first = system.first_indices["u"]
    driven = [int(first[place]) + k for place, k in system.driven]
    return bool(u[0, driven].any() or a[0, driven].any())


def _risks(t: float, linearise: Callable[[], Linear]) -> Iterator[Risk]:
    """Risk of a departure from the equilibrium, now or later."""
    try:
        linear = linearise()
        later = LaterStates(linear)
        departure = find_departure(linear, later)
    except (SceneError, NumericalFailure) as failure:
        yield information(
            "unexamined", "the state", f"not examined whether it lasts: {failure}",
            "simulate from this state",
        )  # fmt: skip
        return
    if departure is not None:
        yield departure_risk(t, departure, later.cause)
