"""Whole turns of hinges that make no difference: a way to rest may wind them up."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError

from ..discontinuities.active_expressions import active_expressions
from ..engine.engine_calls import Probe
from ..run.scene_system import SceneSystem

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

_TURN = 2 * np.pi
_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
#: What a turn of nothing may change by rounding, in parts.
_SAME = 1e-9


def without_turns(model: CompiledScene, begun: Array, q: Array, t: float) -> Array:
    """q (nq,) with hinges within half a turn of where they `begun`, where all bodies stay in their
    places, all efforts as they are, and nothing that the scene asks for reads their angle."""
    for place in _wound(model, begun, q):
        turned = q.copy()
        turned[place] -= _TURN * round((q[place] - begun[place]) / _TURN)
        if _same(model, q, turned, t):
            q = turned
    return q


def _wound(model: CompiledScene, begun: Array, q: Array) -> Iterator[int]:
    """Places in q of angles that are more than half a turn away, and that nothing reads by name."""
    free, read = set(model.free_speeds), None
    for name, slots in model.layout.hinges.items():
        if not slots.nu or not slots.straight:
            continue
        for k, unit in enumerate(slots.u_units):
            place = slots.q + k
            far = abs(q[place] - begun[place]) > _TURN / 2
            if not far or unit != "rad/s" or slots.u + k not in free:
                continue
            read = _read(model) if read is None else read
            if name not in read:
                yield place


def _read(model: CompiledScene) -> set[str]:
    """Hinges whose coordinates an expression, an output or a controller reads."""
    scene, found = model.scene, set[str]()
    for one in active_expressions(scene):
        found |= {name.text.rpartition(".")[0] for name in one.expression.names}
        found |= {scene.hinges[number].name for number in one.hinges}
    texts = [repr(x) for x in (*scene.output, *scene.controller, *scene.coupling)]
    names = model.layout.hinges
    return found | {name for name in names if any(f"{name}." in text for text in texts)}


def _same(model: CompiledScene, q: Array, turned: Array, t: float) -> bool:
    engine, still = model.looped, np.zeros(model.nu)
    memory = engine.start_memory()
    probes = [Probe(i, _AXES, (0.0, 0.0, 0.0)) for i in range(engine.packed.topology.count)]
    seen = []
    for one in (q, turned):
        try:
            one = SceneSystem(engine).start(t, one, still)[: model.nq]
            efforts = engine.inverse_dynamics(t, one, still, still, memory)
        except MstmmError:
            return False
        shown = engine.observe(np.array([t]), one[None], still[None], memory[None], probes,
                               ("points",)).points  # fmt: skip
        seen.append((efforts, shown[0, :, :3], shown[0, :, 15:24], one))
    moved = np.abs(seen[1][3] - turned).max(initial=0.0)
    return bool(moved <= _SAME) and all(
        np.abs(a - b).max(initial=0.0) <= _SAME * max(1.0, float(np.abs(a).max(initial=0.0)))
        for a, b in zip(seen[0][:3], seen[1][:3], strict=True)
    )
