"""Number of refinements that accelerations need with heavy bodies outboard of light ones.

A refinement solves for the residual of inverse dynamics and adds the correction; it is repeated as
long as results change.  The last change estimates the error before it.
"""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure, SceneError

from ...pack.start import start_values
from ..engine import Engine
from .parallel import COUNTING, skewed

#: Relative change of accelerations that is rounding, and one above which they are rejected.
_ROUNDING, _WRONG = 1e-12, 1e-6
#: Accelerations below this fraction of those due to weight, speeds or efforts count as balanced.
_BALANCED = 1e-3
#: Mass ratio above which the masses may be the cause of lost digits.
_UNLIKE = 100.0
#: Maximum number of refinements.
_MOST = 4


def refinements(engine: Engine, q: Array, u: Array, mobility: int) -> int:
    """Number of refinements until accelerations at (q, u) no longer change.

    Accelerations due to random efforts are tested too.  Raises NumericalFailure if they do not
    converge.
    """
    model = engine.packed.model
    efforts = np.random.default_rng(0).uniform(-1.0, 1.0, (2, engine.nu))
    efforts[0] = 0.0
    memory = engine.start_memory()
    states = np.tile(q, (2, 1)), np.tile(u, (2, 1)), np.tile(memory, (2, 1))

    def answers(times: int) -> Array:
        model.refines = times
        return engine.accelerations(0.0, *states, efforts)[1]

    weight = float(np.linalg.norm(engine.packed.described.gravity))
    usual = weight + float(np.abs(u).max(initial=0.0)) ** 2
    usual = usual if mobility > 0 else max(usual, 1.0)  # mechanisms moved by drives may be at rest
    try:
        before = answers(0)
        for times in range(1, _MOST + 1):
            found = answers(times)
            sizes = np.abs(found).max(axis=1)
            least = _BALANCED * max(usual, float(sizes.max()), np.finfo(float).tiny)
            changed = np.abs(found - before).max(axis=1) / np.maximum(sizes, least)
            if not (changed > _ROUNDING).any():
                return times - 1
            before = found
    except NumericalFailure:
        return 0
    finally:
        model.refines = 0
    wrong = float(changed.max())
    if wrong > _WRONG:
        raise NumericalFailure(
            f"accelerations{' of the closed loops' * engine.packed.system.closes} have a relative "
            f"error of {wrong:.1g} that refinement does not reduce: {unlike_masses(engine)}"
        )
    return _MOST


def of_tree(engine: Engine) -> int:
    """Number of refinements of a tree at its start with sweep="refined": at least one.

    Raises SceneError if accelerations do not converge.
    """
    packed = engine.packed
    q, u = start_values(packed.scene, packed.layout, packed.flexible)
    try:
        return max(1, refinements(engine, q, u, 1))
    except NumericalFailure as failure:
        raise SceneError(f'scene: {failure}; or use sweep = "qr"') from None


def unlike_masses(engine: Engine) -> str:
    """End of a message that names the heaviest and the lightest body, with a remedy.

    If their masses are similar, another cause of lost digits in closed loops is named.
    """
    masses = {body.name: body.mass for body in engine.packed.described.body if body.mass > 0}
    if not masses:
        return "make the masses of bodies more similar"
    heavy, light = (choose(masses, key=masses.__getitem__) for choose in (max, min))
    if masses[heavy] < _UNLIKE * masses[light] and engine.packed.system.closes:
        return skewed(engine.packed, COUNTING) or (
            "their constraints are nearly redundant; make axes parallel and points coincide, or "
            "use a ball or cylindrical hinge"
        )
    return (
        f'heavy body "{heavy}" ({masses[heavy]:.3g} kg) outboard of light ones such as "{light}" '
        f"({masses[light]:.3g} kg); make their masses more similar"
    )
