"""Static equilibrium by Newton on the efforts that rest needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.errors import NumericalFailure

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
Needed = Callable[[Array], Array]

_STEP = 1e-6  # of the difference quotients, rad or m
_UPHILL_STEP = 0.5  # longest step away from an unstable equilibrium, rad or m
_MAX_ITERATIONS = 100


def moved(model: Model, q: Array, increment: Array) -> Array:
    """q after a small motion `increment` (nu) along the speeds; quaternions stay unit."""
    engine = model._engine
    rates, _ = engine.accelerations(0.0, q[None].copy(), increment[None].copy(), model._memory(1))
    result = q + rates[0]
    for first in model.layout.quaternions:
        unit = result[first : first + 4]
        result[first : first + 4] = unit / np.linalg.norm(unit)
    return np.asarray(result)


def equilibrium(model: Model, q: Array, t: float, tolerance: float) -> Array:
    """q at which the free coordinates need no effort at rest; see `Model.equilibrium`."""
    still = np.zeros(model.nu)
    free = _free_speeds(model)

    def needed(at: Array) -> Array:
        return np.asarray(model.inverse_dynamics(at, still, still, t)[free])

    q = q.copy()
    scale = 1.0
    residual = needed(q)
    for _ in range(_MAX_ITERATIONS):
        size = float(np.abs(residual).max(initial=0.0))
        slope = _slope(model, q, needed, free)
        scale = max(scale, float(np.abs(slope).max(initial=0.0)))
        if size <= tolerance * scale:
            _refuse_undetermined(model, slope, free)
            return q
        step = np.zeros(model.nu)
        downhill, step[free] = _step(slope, residual)
        if downhill:
            q, residual = _damped(model, q, step, needed, size)
        else:
            q = moved(model, q, _limited(step, _UPHILL_STEP))
            residual = needed(q)
    raise NumericalFailure(
        f"no equilibrium found near the start: after {_MAX_ITERATIONS} steps an effort of "
        f"{size:.3g} (N or N*m) is left; give another start, q = ..."
    )


def _free_speeds(model: Model) -> list[int]:
    """Speeds that no drive prescribes."""
    free = []
    for hinge in model.scene.hinge:
        slots = model.layout.hinges[hinge.name]
        drive = hinge.drive or (None,) * slots.nu
        held = hinge.type == "fixed"
        free += [slots.u + k for k in range(slots.nu) if drive[k] is None and not held]
    return free


def _slope(model: Model, q: Array, needed: Needed, free: list[int]) -> Array:
    columns = []
    for j in free:
        increment = np.zeros(model.nu)
        increment[j] = _STEP
        ahead, behind = moved(model, q, increment), moved(model, q, -increment)
        columns.append((needed(ahead) - needed(behind)) / (2 * _STEP))
    return np.array(columns).reshape(len(free), len(free)).T


def _step(slope: Array, residual: Array) -> tuple[bool, Array]:
    """(whether the stiffness is positive definite, step towards equilibrium).

    Where it is not, the step goes down along the directions that would run uphill, so that an
    unstable equilibrium is left behind (for forces without potential this is only a heuristic).
    """
    values, directions = np.linalg.eigh((slope + slope.T) / 2)
    floor = 1e-9 * float(np.abs(values).max(initial=1e-300))
    if values.min(initial=np.inf) > -floor:
        return True, np.asarray(np.linalg.lstsq(slope, -residual, rcond=1e-9)[0])
    softened = np.maximum(np.abs(values), floor)
    return False, np.asarray(-directions @ ((directions.T @ residual) / softened))


def _limited(step: Array, longest: float) -> Array:
    return np.asarray(step / max(1.0, float(np.abs(step).max(initial=0.0)) / longest))


def _damped(
    model: Model, q: Array, step: Array, needed: Needed, size: float
) -> tuple[Array, Array]:
    """A Newton step, at most one unit long, halved until the residual falls."""
    step = _limited(step, 1.0)
    for _ in range(20):
        trial = moved(model, q, step)
        residual = needed(trial)
        if float(np.abs(residual).max(initial=0.0)) < size:
            break
        step = step / 2
    return trial, residual


def _refuse_undetermined(model: Model, slope: Array, free: list[int]) -> None:
    if not free:
        return
    _, singular, directions = np.linalg.svd(slope)
    scale = max(float(singular[0]), 1e-300)
    loose = [directions[i] for i, s in enumerate(singular) if s < 1e-7 * scale or singular[0] == 0]
    if not loose:
        return
    share = np.abs(np.array(loose)).max(axis=0)
    names = [model.layout.u_names[free[j]] for j in np.nonzero(share > 0.1)[0]]
    raise NumericalFailure(
        "the equilibrium is undetermined along "
        + ", ".join(names)
        + ": nothing pushes these coordinates back; fix them, drive them or add a stiffness"
    )
