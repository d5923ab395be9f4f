"""How often heavy bodies behind light ones make accelerations be refined.

What inverse dynamics of an answer leaves over is answered too, and added: again and again, as long
as that changes anything.  What the last time changes is what is wrong before it.
"""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure, SceneError

from ...pack.start import start_values
from ..engine import Engine
from .parallel import COUNTING, skewed

#: Change of the accelerations, in parts of the largest, that is rounding, and from which on
#: they are not to be believed.
_ROUNDING, _WRONG = 1e-12, 1e-6
#: Part of what weight, speeds or efforts make of them, below which they are balanced.
_BALANCED = 1e-3
#: The ratio of masses from which on it may be what loses digits.
_UNLIKE = 100.0
#: Refinements at most.
_MOST = 4


def refinements(engine: Engine, q: Array, u: Array, mobility: int) -> int:
    """As many as accelerations at (q, u), and those of drawn efforts, take until they stay as they
    are.

    Raises NumericalFailure where they do not.
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
    usual = usual if mobility > 0 else max(usual, 1.0)  # what only drives move may stand still
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
            f"accelerations{' of the closed loops' * engine.packed.system.closes} are wrong by "
            f"{wrong:.1g} of their size, and refining them does not help: {unlike_masses(engine)}"
        )
    return _MOST


def of_tree(engine: Engine) -> int:
    """The same of a tree at its start, where they are asked for: once at least.

    Raises SceneError where they do not stay as they are.
    """
    packed = engine.packed
    q, u = start_values(packed.scene, packed.layout, packed.flexible)
    try:
        return max(1, refinements(engine, q, u, 1))
    except NumericalFailure as failure:
        raise SceneError(f'scene: {failure}; or use sweep = "qr"') from None


def unlike_masses(engine: Engine) -> str:
    """The heaviest body and the lightest that has a mass, and what to do; where they are alike,
    what else loses the digits of closed loops."""
    masses = {body.name: body.mass for body in engine.packed.described.body if body.mass > 0}
    if not masses:
        return "bring the masses of bodies nearer together"
    heavy, light = (choose(masses, key=masses.__getitem__) for choose in (max, min))
    if masses[heavy] < _UNLIKE * masses[light] and engine.packed.system.closes:
        return skewed(engine.packed, COUNTING) or (
            "what closes them nearly repeats what others do; make axes parallel and points meet, "
            "or use a ball or cylindrical hinge"
        )
    return (
        f'body "{heavy}" ({masses[heavy]:.3g} kg) hangs behind light ones such as "{light}" '
        f"({masses[light]:.3g} kg); bring their masses nearer together"
    )
