"""Initial state of a compiled scene, with drives, closed loops and static deformations."""

from __future__ import annotations

from mstmm.array_validation import Array

from ..engine.compiled_scene import CompiledScene
from ..packing.coordinate_layout import start_values
from .scene_system import SceneSystem
from .static_start.static_deformation import static_deformation, static_deformation_with_loops


def initial_state(compiled: CompiledScene) -> tuple[Array, Array]:
    """Initial state (q, u) at t = 0; NumericalFailure where a static deformation is not found."""
    packed, engine = compiled.packed_scene, compiled.looped
    q, u = start_values(packed.scene, compiled.coordinate_layout, packed.flexible)
    if compiled.loop_start is None:
        y = SceneSystem(engine).start(0.0, q, u)
        q, u = y[: compiled.nq], y[compiled.nq : compiled.nq + compiled.nu]
    else:
        q, u = (x.copy() for x in compiled.loop_start.start)
    tables = (*packed.user_scene.beam, *packed.user_scene.elastic)
    static_names = [b.name for b in tables if b.name in packed.flexible and b.initial.static]
    if not static_names:
        return q, u
    bodies = {name: compiled.flexible_bodies[name] for name in static_names}
    if compiled.independent_speeds is not None:
        return static_deformation_with_loops(compiled, compiled.independent_speeds, q, u, bodies)
    memory = engine.start_memory()
    q = static_deformation(
        lambda q, u, udot: engine.inverse_dynamics(0.0, q, u, udot, memory),
        q, u, bodies, compiled.coordinate_layout.modal,
    )  # fmt: skip
    return q, u
