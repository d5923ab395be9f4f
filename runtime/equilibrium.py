"""Static equilibrium by Newton on the efforts that rest needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.errors import NumericalFailure

from .layout import refuse_dense

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
Needed = Callable[[Array], Array]

_STEP = 1e-6  # of the difference quotients, rad or m
_LONGEST = 0.5  # step, rad or m
_SOFT = 1e-6  # part of the largest stiffness below which a direction counts as slack
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
    refuse_dense(model.nu, "the stiffness matrix")
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
        step[free] = _step(slope, residual)
        q, residual = _followed(model, q, step, needed, free)
    raise NumericalFailure(
        f"no equilibrium found near the start: after {_MAX_ITERATIONS} steps an effort of "
        f"{size:.3g} (N or N*m) is left; give another start, q = ..."
    )


def _free_speeds(model: Model) -> list[int]:
    """Speeds that no drive prescribes."""
    free = []
    for number, hinge in enumerate(model._engine.packed.scene.hinges):
        slots = model.layout.slots(number)
        drive = hinge.drive or (None,) * slots.nu
        held = hinge.type == "fixed"
        free += [slots.u + k for k in range(slots.nu) if drive[k] is None and not held]
    for slots in model.layout.modal.values():
        free += range(slots.u, slots.u + slots.nu)
    return free


def _slope(model: Model, q: Array, needed: Needed, free: list[int]) -> Array:
    columns = []
    for j in free:
        increment = np.zeros(model.nu)
        increment[j] = _STEP
        ahead, behind = moved(model, q, increment), moved(model, q, -increment)
        columns.append((needed(ahead) - needed(behind)) / (2 * _STEP))
    return np.array(columns).reshape(len(free), len(free)).T


def _step(slope: Array, residual: Array) -> Array:
    """Newton's step where the stiffness is positive definite; else one that runs downhill too.

    Along directions in which the stiffness is negative or vanishes, Newton would run uphill or far
    away; the step goes with the forces there, so that unstable equilibria are left behind (for
    forces without potential this is only a heuristic).
    """
    values, directions = np.linalg.eigh((slope + slope.T) / 2)
    largest = float(np.abs(values).max(initial=1e-300))
    if values.min(initial=np.inf) > _SOFT * largest:
        return np.asarray(np.linalg.solve(slope, -residual))
    softened = np.maximum(np.abs(values), _SOFT * largest)
    return np.asarray(-directions @ ((directions.T @ residual) / softened))


def _followed(
    model: Model, q: Array, step: Array, needed: Needed, free: list[int]
) -> tuple[Array, Array]:
    """q after the step, at most _LONGEST long, halved until it falls or does not climb again.

    Where forces have a potential, `needed` is its gradient: the step has not passed the bottom by
    much as long as the gradient along it has not turned around to more than half its size.
    """
    step = step / max(1.0, float(np.abs(step).max(initial=0.0)) / _LONGEST)
    before = needed(q)
    size, along = float(np.abs(before).max(initial=0.0)), abs(float(before @ step[free]))
    for _ in range(20):
        trial = moved(model, q, step)
        residual = needed(trial)
        falls = float(np.abs(residual).max(initial=0.0)) < size
        if falls or float(residual @ step[free]) <= along / 2:
            break
        step, along = step / 2, along / 2
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
    names = [model.layout.u_name(int(free[j])) for j in np.nonzero(share > 0.1)[0]]
    raise NumericalFailure(
        "the equilibrium is undetermined along "
        + ", ".join(names)
        + ": nothing pushes these coordinates back; fix them, drive them or add a stiffness"
    )
