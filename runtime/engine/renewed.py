"""A packed scene under other inputs: its records of inputs are written anew, and nothing else."""

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
    """The same with inputs at other numbers, or following other signals of the scene; none of them
    drives anything."""
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
    """The same with inputs in memory, behind what is there, beginning with what they are at t (s):
    whoever makes a run may set them between its steps."""
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
    """The same with some inputs as these over time; none of them drives anything.  The scene does
    not know of it."""
    channels = packed.channels | dict(named)
    system = replace(
        packed.system, inputs=tuple(channels.values()), by_time=by_time(packed.scene, channels)
    )
    return _rewritten(packed, system)


def _rewritten(packed: Packed, system: System) -> Packed:
    slopes, memory = packed.slopes(), Memory(packed.ffi)  # made once, for the records are shared
    model = memory.new("mstmm_model *", packed.model[0])
    model.n_memory = system.n_memory
    model.inputs = write_inputs(system.inputs, system.held.places, memory)
    written = replace(packed.written, model=model, kept=[packed.written, *memory.kept])
    return replace(
        packed, system=system, model=model, written=written, _time_maps={}, _slopes=slopes
    )
