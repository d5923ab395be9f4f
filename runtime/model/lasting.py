"""Whether an equilibrium lasts while drives move on and loads change with time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import NumericalFailure, SceneError
from mstmm.risk import DeferredRisks, Risk, information

from ..linear.operating_point.departure import find_departure
from ..linear.operating_point.later import LaterStates
from ..linear.validity import departure_risk
from ..run.scene_system import SceneSystem

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..linear.linear_model import Linear
    from .equilibrium import Equilibrium


def check_lasting(
    model: CompiledScene, found: Equilibrium, t: float, linearise: Callable[[], Linear]
) -> Equilibrium:
    """The equilibrium of time t (s), with a risk where it is that of a moment; `linearise` gives
    the linear model about it.

    Raises NumericalFailure where drives move there and do not leave it at rest.
    """
    if model.packed.system.steady or not len(found.residuals):
        return found
    earlier = found.findings
    if not _drives_move(model, found, t):
        found.findings = DeferredRisks(lambda: (*earlier, *_risks(t, linearise)))
        return found
    risks = tuple(_risks(t, linearise))
    for risk in risks:
        if risk.doubt:
            raise NumericalFailure(
                f"no equilibrium: {risk.means}; simulate the motion, or let the drives stand still"
            )
    found.findings = (*earlier, *risks)
    return found


def _drives_move(model: CompiledScene, found: Equilibrium, t: float) -> bool:
    """Whether a drive has a speed or an acceleration."""
    system, engine = model.packed.system, model.looped
    whole = SceneSystem(engine).start(t, np.asarray(found), np.zeros(model.nu))
    q, u = whole[None, : model.nq].copy(), whole[None, model.nq : model.nq + model.nu].copy()
    _, a = engine.accelerations(t, q, u, engine.start_memory()[None])
    first = system.places["u"]
    driven = [int(first[place]) + k for place, k in system.driven]
    return bool(u[0, driven].any() or a[0, driven].any())


def _risks(t: float, linearise: Callable[[], Linear]) -> Iterator[Risk]:
    """A risk where the state is left, there or later."""
    try:
        linear = linearise()
        later = LaterStates(linear)
        leaving = find_departure(linear, later)
    except (SceneError, NumericalFailure) as failure:
        yield information(
            "unexamined", "the state", f"not examined for how long it lasts: {failure}",
            "simulate from this state",
        )  # fmt: skip
        return
    if leaving is not None:
        yield departure_risk(t, leaving, later.cause)
