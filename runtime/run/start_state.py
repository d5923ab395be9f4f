"""The state in which a compiled scene begins: as its hinges say it, drives and static shapes taken
in."""

from __future__ import annotations

from mstmm.array_validation import Array

from ..engine.compiled_scene import CompiledScene
from ..packing.initial_state import start_values
from .scene_system import SceneSystem
from .static_start.static_deformation import settle, settle_among_loops


def initial_state(compiled: CompiledScene) -> tuple[Array, Array]:
    """(q, u) at t = 0.  Raises NumericalFailure where a static shape is not found."""
    packed, engine = compiled.packed, compiled.looped
    q, u = start_values(packed.scene, compiled.layout, packed.flexible)
    if compiled.closed is None:
        y = SceneSystem(engine).start(0.0, q, u)
        q, u = y[: compiled.nq], y[compiled.nq : compiled.nq + compiled.nu]
    else:
        q, u = (one.copy() for one in compiled.closed.start)
    described = (*packed.described.beam, *packed.described.elastic)
    still = [b.name for b in described if b.name in packed.flexible and b.initial.static]
    if not still:
        return q, u
    bodies = {name: compiled.flexible[name] for name in still}
    if compiled.freedom is not None:
        return settle_among_loops(compiled, compiled.freedom, q, u, bodies)
    memory = engine.start_memory()
    q = settle(
        lambda q, u, udot: engine.inverse_dynamics(0.0, q, u, udot, memory),
        q, u, bodies, compiled.layout.modal,
    )  # fmt: skip
    return q, u
