"""Inputs of a scene: set by the caller, in packed scenes, among the numbers of compiled code."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array, finite_array, finite_float, mapping_by_name
from mstmm.errors import SceneError
from mstmm.numerics.piecewise_polynomial import NUMBERS_PER_PIECE, PiecewisePolynomial
from mstmm.scene import Scene
from mstmm.scene.checks.inputs import input_references
from mstmm.scene.validators.validation_messages import did_you_mean

from ..discontinuities.active_expressions import active_expressions
from ..kernels.c_records import Memory
from ..packing.packed_scene import PackedScene
from ..packing.records.model_record import write_inputs
from ..packing.scene_parameters import scene_data, scene_from_data
from ..packing.system import HeldInputs, System
from ..packing.system_builder import has_timed_loads

if TYPE_CHECKING:
    from ..packing.system import System

#: A number, the name of a signal, (times, values), or the keys of a [[signal]].
InputValue = float | str | tuple[ArrayLike, ArrayLike] | Mapping[str, Any]

_EXPECTED_INPUT = "a number, the name of a signal, (times, values) or the keys of a [[signal]]"


def apply_without_recompile(
    scene: Scene, inputs: Mapping[str, InputValue]
) -> dict[str, float | str] | None:
    """Validate inputs that change only values: numbers or signal names, without drives.

    Returns them by name, or None if the scene must be validated again.  Raises SceneError for
    unknown inputs and invalid values.
    """
    input_names = {channel.name for channel in scene.input}
    signal_names = {channel.name for channel in scene.signal}
    driving_inputs = {
        name for channel in active_expressions(scene) if channel.drive for name in channel.inputs
    }
    values: dict[str, float | str] = {}
    for name, value in mapping_by_name("inputs", inputs).items():
        if name not in input_names:
            raise _unknown_input_error(name, scene)
        _check_not_controlled(name, scene)
        is_unknown_signal = isinstance(value, str) and value not in signal_names
        if name in driving_inputs or is_unknown_signal or _is_over_time(value):
            return None
        values[name] = value if isinstance(value, str) else finite_float(_input_label(name), value)
    return values


def scene_with_inputs(scene: Scene, inputs: Mapping[str, InputValue]) -> Scene:
    """Scene with other inputs, validated again; inputs over time become signals.

    Raises SceneError for unknown inputs and invalid values.
    """
    data = scene_data(scene)
    tables = {table["name"]: table for table in data.get("input", [])}
    for name, value in mapping_by_name("inputs", inputs).items():
        if name not in tables:
            raise _unknown_input_error(name, scene)
        _check_not_controlled(name, scene)
        signal = _signal_table(name, value)
        if signal is None:
            tables[name]["value"] = (
                value if isinstance(value, str) else finite_float(_input_label(name), value)
            )
            continue
        signals = data.setdefault("signal", [])
        signal["name"] = _unused_signal_name(scene, name)
        signals[:] = [
            other_table for other_table in signals if other_table["name"] != signal["name"]
        ]
        signals.append(signal | {"unit": tables[name]["unit"]})
        tables[name]["value"] = signal["name"]
        tables[name].pop("rates", None)
    return scene_from_data(data, scene, "scene with these inputs")


def _check_not_controlled(name: str, scene: Scene) -> None:
    if name in scene.controllers_by_input:
        raise SceneError(
            f'{_input_label(name)}: controller "{scene.controllers_by_input[name]}" sets this '
            "input; add another input to the expression that reads it"
        )


def _unknown_input_error(name: str, scene: Scene) -> SceneError:
    if any(signal.name == name for signal in scene.signal):
        return SceneError(
            f"{_input_label(name)}: this is a signal of the scene and cannot be set; add an "
            f"[[input]] with "
            f'value = "{name}" and set that'
        )
    suggestion = did_you_mean(name, (channel.name for channel in scene.input))
    return SceneError(f"{_input_label(name)}: there is no such input in the scene{suggestion}")


def _input_label(name: str) -> str:
    return f'inputs["{name}"]'


def _signal_table(name: str, given: Any) -> dict[str, Any] | None:
    """Signal table of an input over time; None for a number or a signal name."""
    if isinstance(given, Mapping):
        return {key: _plain_value(name, key, value) for key, value in given.items()}
    if not _is_over_time(given):
        return None
    if len(given) != 2 or any(not hasattr(row, "__len__") for row in given):
        raise SceneError(f"{_input_label(name)}: expected {_EXPECTED_INPUT}")
    return {
        key: _plain_value(name, key, row)
        for key, row in zip(("times", "values"), given, strict=True)
    }


def _is_over_time(given: Any) -> bool:
    is_single = isinstance(given, str) or getattr(given, "ndim", 1) == 0  # arrays of one number
    return not is_single and hasattr(given, "__len__")


def _plain_value(name: str, key: str, value: Any) -> Any:
    return (
        finite_array(f"{_input_label(name)} {key}", value).tolist()
        if key in ("times", "values")
        else value
    )


def _unused_signal_name(scene: Scene, name: str) -> str:
    """Name for the new signal of an input.

    It may be that of a signal of an earlier call that only this input uses, which is replaced.
    """
    used_names = {*scene.channels, *scene.constants}
    own_signals = {signal for signal, user_name in input_references(scene) if user_name == name}
    own_signals -= {signal for signal, user_name in input_references(scene) if user_name != name}
    signal_name = f"{name}_given"
    while signal_name in used_names - own_signals:
        signal_name += "_"
    return signal_name


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
    renewed_packed.scene = expanded_scene
    renewed_packed.expanded = replace(expanded, scene=expanded_scene, user_scene=described)
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


IndexPairs = Sequence[tuple[int, int]]

#: Index of the value among the numbers of a constant input; see `mstmm_input_now`.
_VALUE_INDEX = 1


class LiveInputs:
    """Inputs of a system among the numbers p that its compiled code reads.

    `read` contains pairs (index among the numbers of all inputs, index in p).  `indices` (inputs,
    `NUMBERS_PER_PIECE`) are the indices in p, -1 for numbers that are not read.
    """

    def __init__(self, system: System, read: IndexPairs) -> None:
        self._inputs = inputs = system.inputs
        self.indices: NDArray[np.int32] = np.full(
            (len(inputs), NUMBERS_PER_PIECE), -1, dtype=np.int32
        )
        for entry, memory_index in read:
            self.indices[entry // NUMBERS_PER_PIECE, entry % NUMBERS_PER_PIECE] = memory_index
        self._varying = [
            i for i, channel in enumerate(inputs) if channel.varies and (self.indices[i] >= 0).any()
        ]
        self._stored = [
            (i, memory_index) for i, memory_index in enumerate(system.held_inputs.memory_indices)
            if memory_index >= 0 and (self.indices[i] >= 0).any()
        ]  # fmt: skip

    @property
    def varies(self) -> bool:
        """True if any number in p changes with time or is stored in memory."""
        return bool(self._varying or self._stored)

    def numbers_in_run(self, p: Array, t: float, memory: Array) -> Array:
        """Numbers p (np,) at time t (s) of a run, with stored inputs from its `memory`."""
        numbers = self.numbers_at(p, np.array([t])).reshape(-1).copy()
        for i, memory_index in self._stored:
            is_read = self.indices[i] >= 0
            pieces = np.where(
                np.arange(NUMBERS_PER_PIECE) == _VALUE_INDEX, memory[memory_index], 0.0
            )
            numbers[self.indices[i, is_read]] = pieces[is_read]
        return numbers

    def numbers_at(self, p: Array, t: Array) -> Array:
        """Numbers p (n, np) at times t (n,), s; the given p (np,) if it is constant."""
        if not self._varying:
            return p
        rows = np.repeat(p[None], len(t), axis=0)
        for i in self._varying:
            is_read = self.indices[i] >= 0
            pieces = np.array([self._inputs[i].piece_at(time) for time in t.tolist()])
            rows[:, self.indices[i][is_read]] = pieces[:, is_read]
        return rows
