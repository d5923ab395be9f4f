"""Packed scenes with other inputs; only the input records are rewritten."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mstmm.numerics.piecewise_polynomial import PiecewisePolynomial

from ..packing.packed_scene import PackedScene
from ..packing.records.memory import Memory
from ..packing.records.model_record import write_inputs
from ..packing.system import HeldInputs, System
from ..packing.system_builder import has_timed_loads


def with_input_values(packed: PackedScene, values: Mapping[str, float | str]) -> PackedScene:
    """Packed scene with other numbers or signals for inputs that no drive uses."""
    expanded = packed.expanded
    described = expanded.user_scene.with_inputs(values)
    is_unexpanded = expanded.scene is expanded.user_scene
    expanded_scene = described if is_unexpanded else expanded.scene.with_inputs(values)
    channels = described.channels
    time_inputs = has_timed_loads(expanded_scene, channels)
    system = replace(packed.system, inputs=tuple(channels.values()), depends_on_time=time_inputs)
    renewed_packed = _with_new_records(packed, system)
    renewed_packed.scene, renewed_packed.expanded = (
        expanded_scene,
        replace(expanded, scene=expanded_scene, user_scene=described),
    )
    return renewed_packed


def with_held_inputs(packed: PackedScene, names: Sequence[str], t: float) -> PackedScene:
    """Packed scene with the named inputs in memory, where the caller of a run can set them.

    They are appended to the memory with their values at t (s) and may be set between steps.
    """
    system, memory_indices = packed.system, list(packed.system.held_inputs.memory_indices)
    start = [packed.user_scene.channels[name].value(t) for name in names]
    for k, name in enumerate(names):
        memory_indices[packed.layout.inputs[name]] = system.n_memory + k
    held = HeldInputs(
        system.held_inputs.first, tuple(memory_indices), (*system.held_inputs.start, *start)
    )
    system_with_memory = replace(system, held_inputs=held, n_memory=system.n_memory + len(names))
    renewed_packed = _with_new_records(packed, system_with_memory)
    renewed_packed.held_input_names = packed.held_input_names | set(names)
    return renewed_packed


def with_input_pieces(packed: PackedScene, named: Mapping[str, PiecewisePolynomial]) -> PackedScene:
    """Packed scene with functions of time for some inputs that no drive uses.

    The scene tables remain unchanged.
    """
    channels = packed.channels | dict(named)
    system = replace(
        packed.system,
        inputs=tuple(channels.values()),
        depends_on_time=has_timed_loads(packed.scene, channels),
    )
    return _with_new_records(packed, system)


def _with_new_records(packed: PackedScene, system: System) -> PackedScene:
    slopes, memory = packed.slopes(), Memory(packed.ffi)  # computed once: the records are shared
    model = memory.new("mstmm_model *", packed.model[0])
    model.n_memory = system.n_memory
    model.inputs = write_inputs(system.inputs, system.held_inputs.memory_indices, memory)
    written = replace(packed.written, model=model, keep_alive=[packed.written, *memory.keep_alive])
    return replace(
        packed, system=system, model=model, written=written, _time_maps={}, _slopes=slopes
    )
