"""Removal of full turns of hinges that have no effect, after a search for equilibrium."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError

from ..discontinuities.active_expressions import active_expressions
from ..engine.looped_engine import Probe
from ..run.scene_system import SceneSystem

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

_TURN = 2 * np.pi
_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
#: Relative change due to rounding when a full turn without effect is removed.
_TOLERANCE = 1e-9


def remove_full_turns(model: CompiledScene, start: Array, q: Array, t: float) -> Array:
    """q (nq,) with hinge angles within half a turn of the `start` (nq,), without effect.

    A full turn is removed only if all bodies keep their poses, all efforts their values, and no
    expression, output or controller of the scene reads the angle.
    """
    for place in _wound_coordinates(model, start, q):
        unwound = q.copy()
        unwound[place] -= _TURN * round((q[place] - start[place]) / _TURN)
        if _has_same_effect(model, q, unwound, t):
            q = unwound
    return q


def _wound_coordinates(model: CompiledScene, start: Array, q: Array) -> Iterator[int]:
    """Indices in q of angles more than half a turn from the start that nothing reads by name."""
    free, referenced = set(model.free_speed_indices), None
    for name, slots in model.coordinate_layout.hinges.items():
        if not slots.nu or not slots.rates_are_speeds:
            continue
        for k, unit in enumerate(slots.u_units):
            index = slots.q + k
            is_wound = abs(q[index] - start[index]) > _TURN / 2
            if not is_wound or unit != "rad/s" or slots.u + k not in free:
                continue
            referenced = _referenced_hinges(model) if referenced is None else referenced
            if name not in referenced:
                yield index


def _referenced_hinges(model: CompiledScene) -> set[str]:
    """Names of hinges whose coordinates an expression, output or controller reads."""
    scene, names_read = model.scene, set[str]()
    for active in active_expressions(scene):
        names_read |= {name.text.rpartition(".")[0] for name in active.expression.names}
        names_read |= {scene.hinges[number].name for number in active.hinges}
    texts = [repr(x) for x in (*scene.output, *scene.controller, *scene.coupling)]
    names = model.coordinate_layout.hinges
    return names_read | {name for name in names if any(f"{name}." in text for text in texts)}


def _has_same_effect(model: CompiledScene, q: Array, unwound: Array, t: float) -> bool:
    engine, zeros = model.looped, np.zeros(model.nu)
    memory = engine.start_memory()
    probes = [Probe(i, _AXES, (0.0, 0.0, 0.0)) for i in range(engine.packed.topology.count)]
    observed = []
    for state in (q, unwound):
        try:
            state = SceneSystem(engine).start(t, state, zeros)[: model.nq]
            efforts = engine.inverse_dynamics(t, state, zeros, zeros, memory)
        except MstmmError:
            return False
        points = engine.observe(np.array([t]), state[None], zeros[None], memory[None], probes,
                               ("points",)).points  # fmt: skip
        observed.append((efforts, points[0, :, :3], points[0, :, 15:24], state))
    correction = np.abs(observed[1][3] - unwound).max(initial=0.0)
    return bool(correction <= _TOLERANCE) and all(
        np.abs(a - b).max(initial=0.0) <= _TOLERANCE * max(1.0, float(np.abs(a).max(initial=0.0)))
        for a, b in zip(observed[0][:3], observed[1][:3], strict=True)
    )
