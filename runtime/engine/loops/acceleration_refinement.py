"""Number of acceleration refinements for heavy bodies outboard of light ones.

A refinement solves for the residual of inverse dynamics and adds the correction; it is repeated
until results no longer change.  The last change estimates the error before it.
"""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ...packing.coordinate_layout import start_values
from ..looped_engine import LoopedEngine
from .near_parallel_axes import MIN_COUNTING_ANGLE, find_skewed_axis

#: Relative change of accelerations that counts as rounding, and the largest accepted one.
_ROUNDING, _MAX_ERROR = 1e-12, 1e-6
#: Accelerations below this fraction of those due to weight, speeds or efforts count as balanced.
_BALANCED_FRACTION = 1e-3
#: Mass ratio above which the masses may cause a loss of digits.
_MIN_MASS_RATIO = 100.0
#: Maximum number of refinements.
_MAX_REFINEMENTS = 4


def count_refinements(engine: LoopedEngine, q: Array, u: Array, mobility: int) -> int:
    """Number of refinements until the accelerations at (q, u) converge.

    Accelerations due to random efforts are tested too.  Raises NumericalFailure if refinement does
    not reduce a large error.
    """
    model = engine.packed.model
    efforts = np.random.default_rng(0).uniform(-1.0, 1.0, (2, engine.nu))
    efforts[0] = 0.0
    memory = engine.start_memory()
    states = np.tile(q, (2, 1)), np.tile(u, (2, 1)), np.tile(memory, (2, 1))

    def accelerations(count: int) -> Array:
        model.refines = count
        return engine.accelerations(0.0, *states, efforts)[1]

    weight = float(np.linalg.norm(engine.packed.user_scene.gravity))
    characteristic_acceleration = weight + float(np.abs(u).max(initial=0.0)) ** 2
    characteristic_acceleration = (
        characteristic_acceleration if mobility > 0 else max(characteristic_acceleration, 1.0)
    )  # driven mechanisms may be at rest
    try:
        previous = accelerations(0)
        for count in range(1, _MAX_REFINEMENTS + 1):
            refined = accelerations(count)
            sizes = np.abs(refined).max(axis=1)
            minimum = _BALANCED_FRACTION * max(
                characteristic_acceleration, float(sizes.max()), np.finfo(float).tiny
            )
            relative_change = np.abs(refined - previous).max(axis=1) / np.maximum(sizes, minimum)
            if not (relative_change > _ROUNDING).any():
                return count - 1
            previous = refined
    except NumericalFailure:
        return 0
    finally:
        model.refines = 0
    largest_error = float(relative_change.max())
    if largest_error > _MAX_ERROR:
        raise NumericalFailure(
            f"accelerations{' of the closed loops' * engine.packed.system.has_loops} have a "
            f"relative error of {largest_error:.1g} that refinement does not reduce: "
            f"{mass_ratio_text(engine)}"
        )
    return _MAX_REFINEMENTS


def count_tree_refinements(engine: LoopedEngine) -> int:
    """Number of refinements of a tree at its initial state with sweep="refined": at least one.

    Raises SceneError if accelerations do not converge.
    """
    packed = engine.packed
    q, u = start_values(packed.scene, packed.layout, packed.flexible)
    try:
        return max(1, count_refinements(engine, q, u, 1))
    except NumericalFailure as failure:
        raise SceneError(f'scene: {failure}; or use sweep = "qr"') from None


def mass_ratio_text(engine: LoopedEngine) -> str:
    """Cause of lost digits for a message: heaviest and lightest body, with a remedy.

    If their masses are similar, another cause in closed loops is named.
    """
    masses = {body.name: body.mass for body in engine.packed.user_scene.body if body.mass > 0}
    if not masses:
        return "make the masses of bodies more similar"
    heaviest, lightest = (extreme(masses, key=masses.__getitem__) for extreme in (max, min))
    if masses[heaviest] < _MIN_MASS_RATIO * masses[lightest] and engine.packed.system.has_loops:
        return find_skewed_axis(engine.packed, MIN_COUNTING_ANGLE) or (
            "their constraints are nearly redundant; make axes parallel and points coincide, or "
            "use a ball or cylindrical hinge"
        )
    return (
        f'heavy body "{heaviest}" ({masses[heaviest]:.3g} kg) outboard of light ones such as '
        f'"{lightest}" '
        f"({masses[lightest]:.3g} kg); make their masses more similar"
    )
