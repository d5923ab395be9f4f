"""Packed scenes with other inputs: only the records of inputs are written again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mstmm.numbers.pieces import Pieces

from ..pack.internal import by_time
from ..pack.packed import Packed
from ..pack.records.memory import Memory
from ..pack.records.model import write_inputs
from ..pack.system import Held, System


def with_values(packed: Packed, values: Mapping[str, float | str]) -> Packed:
    """Packed scene with other numbers or signals for inputs that no drive uses."""
    expanded = packed.expanded
    described = expanded.described.with_inputs(values)
    alone = expanded.scene is expanded.described
    nodes = described if alone else expanded.scene.with_inputs(values)
    channels = described.channels
    by = by_time(nodes, channels)
    system = replace(packed.system, inputs=tuple(channels.values()), by_time=by)
    found = _rewritten(packed, system)
    found.scene, found.expanded = nodes, replace(expanded, scene=nodes, described=described)
    return found


def with_held(packed: Packed, names: Sequence[str], t: float) -> Packed:
    """Packed scene with the named inputs in memory, so that a run's caller can set them.

    They are appended to the memory with their values at t (s) and may be set between steps.
    """
    system, places = packed.system, list(packed.system.held.places)
    start = [packed.described.channels[name].value(t) for name in names]
    for k, name in enumerate(names):
        places[packed.layout.inputs[name]] = system.n_memory + k
    held = Held(system.held.first, tuple(places), (*system.held.start, *start))
    longer = replace(system, held=held, n_memory=system.n_memory + len(names))
    found = _rewritten(packed, longer)
    found.held = packed.held | set(names)
    return found


def with_pieces(packed: Packed, named: Mapping[str, Pieces]) -> Packed:
    """Packed scene with given functions of time for some inputs that no drive uses.

    The scene itself is not changed.
    """
    channels = packed.channels | dict(named)
    system = replace(
        packed.system, inputs=tuple(channels.values()), by_time=by_time(packed.scene, channels)
    )
    return _rewritten(packed, system)


def _rewritten(packed: Packed, system: System) -> Packed:
    slopes, memory = packed.slopes(), Memory(packed.ffi)  # computed once: the records are shared
    model = memory.new("mstmm_model *", packed.model[0])
    model.n_memory = system.n_memory
    model.inputs = write_inputs(system.inputs, system.held.places, memory)
    written = replace(packed.written, model=model, kept=[packed.written, *memory.kept])
    return replace(
        packed, system=system, model=model, written=written, _time_maps={}, _slopes=slopes
    )
