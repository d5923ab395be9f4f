"""Expressions that C evaluates during a run: measured quantities, outputs, controllers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import ExpressionError, NumericalFailure, SceneError
from mstmm.expression.derivatives import input_node
from mstmm.expression.expression import Expression, Name, parse
from mstmm.ir import Port
from mstmm.ir.graph import Graph, Node
from mstmm.ir.tape import compile_tape
from mstmm.scene import Output
from mstmm.scene.tables.scene_tables import SceneTables
from mstmm.scene.validators.validation_messages import did_you_mean

from ..engine.looped_engine import LoopedEngine, Probe
from ..engine.quantity_registry import (
    BODY_COMPONENTS,
    HINGE_COMPONENTS,
    SUMS,
    BodyReferences,
    components,
    coordinate_columns,
)
from ..kernels.c_records import c_tape
from ..packing.expression_tapes import inputs_port, state_ports
from ..packing.packed_scene import PackedScene, resize_workspace

#: Port of the tape, and index in it.
Slot = tuple[str, int]

#: Ports that need an observation of the state.
_OBSERVED_PORTS = ("points", "loads", "efforts", "udot", "sums")

#: Sums over the scene that are single columns.
_SUM_COMPONENTS = components({name: kind for name, kind in SUMS.items() if name != "energy"})


class MeasuredQuantities:
    """Expressions of measured quantities as a C record.

    `record` is their `mstmm_measure *`, `numbers` their count.  `others` are further valid names,
    suggested for a misspelt one.  Raises SceneError for a quantity that cannot be measured during a
    run.
    """

    def __init__(
        self, engine: LoopedEngine, expressions: Sequence[Expression], others: Sequence[str] = ()
    ) -> None:
        self._engine, self._graph, self._others = engine, Graph(), others
        self._references = BodyReferences(engine.packed.user_scene.skeleton)
        self._probes: dict[str, int] = {}
        self._read = set[str]()
        nodes = [expression.build(self._graph, self._node) for expression in expressions]
        self.numbers = len(nodes)
        packed, lib, ffi = engine.packed, engine.lib, engine.ffi
        sizes = {
            "points": int(lib.MSTMM_PROBE_NUMBERS) * len(self._probes),
            "loads": 6 * packed.topology.count, "efforts": engine.nu, "udot": engine.nu,
            "sums": int(lib.MSTMM_SUM_NUMBERS),
        }  # fmt: skip
        sizes = {name: n if name in self._read else 0 for name, n in sizes.items()}
        ports = [*state_ports(packed.layout), *(Port(name, (n,)) for name, n in sizes.items())]
        ports.append(inputs_port(packed.layout))
        kernel = self._graph.kernel(
            "measured", ports, [Port("values", (len(nodes),))], {"values": nodes}
        )
        tape, self._keep_alive = compile_tape(kernel), list[object]()
        resize_workspace(packed, tape.slots)
        self.record = ffi.new("mstmm_measure *")
        self.record.tape = c_tape(ffi, tape, self._keep_alive)
        self.record.observes = bool(self._read)
        observation = self.record.shown
        for name, n in sizes.items():
            array = np.zeros(max(1, n))
            self._keep_alive.append(array)
            if name in self._read:
                setattr(observation, name, engine.pointer(array))
        records = engine.probes([Probe(*packed.end(reference)) for reference in self._probes])
        observation.n_probes, observation.probes = len(self._probes), records
        self._keep_alive.append(records)

    def _node(self, name: Name) -> Node:
        graph, inputs = self._graph, self._engine.packed.layout.inputs
        if name.text == "t":
            return graph.element("t", 0)
        if name.text in inputs:
            return input_node(inputs[name.text], graph.element("t", 0))
        if name.text == "energy":
            kinetic, gravity, springs = (self._element(("sums", k)) for k in range(3))
            return kinetic + gravity + springs
        slot = self._slot(name.text)
        if slot is None:
            raise SceneError(
                f'"{name.text}": this quantity cannot be measured during a run'
                f"{self._suggestion(name.text)}; expected a coordinate, speed, acceleration, "
                "effort, or a component of force or moment of a hinge; a component of position, "
                "velocity, acceleration, angular velocity or angular acceleration of a body or an "
                "end (no quaternions); or an energy, the power or a momentum of the scene"
            )
        return self._element(slot)

    def _suggestion(self, text: str) -> str:
        """Suggestion of a similar valid name, "" if none is similar."""
        hinges = self._engine.packed.layout.hinges.items()
        names = [
            f"{hinge}.{x}" for hinge, slots in hinges for x in (*slots.q_names, *slots.u_names)
        ]
        suggestion = did_you_mean(text, [*self._others, *names])
        return suggestion if "did you mean" in suggestion else ""

    def _element(self, slot: Slot) -> Node:
        if slot[0] in _OBSERVED_PORTS:
            self._read.add(slot[0])
        return self._graph.element(*slot)

    def _slot(self, text: str) -> Slot | None:
        """Slot of a quantity of the scene, a hinge, a body or an end; None if there is none."""
        if text in _SUM_COMPONENTS:
            kind, k = _SUM_COMPONENTS[text]
            return "sums", kind.columns.start + k
        parts = text.split(".")
        for count in range(len(parts) - 1, 0, -1):
            owner, quantity = ".".join(parts[:count]), ".".join(parts[count:])
            slot = self._hinge_slot(owner, quantity) or self._end_slot(owner, quantity)
            if slot is not None:
                return slot
        return None

    def _hinge_slot(self, owner: str, quantity: str) -> Slot | None:
        packed = self._engine.packed
        slots = packed.layout.hinges.get(owner) or packed.layout.modal.get(owner)
        if slots is None:
            return None
        is_modal = owner in packed.layout.modal
        for column in coordinate_columns(slots, efforts=not is_modal):
            if quantity in column.names:
                return column.part, column.index
        kind, k = HINGE_COMPONENTS.get(quantity, (None, 0))
        if kind is None or not kind.part or is_modal:
            return None
        return kind.part, 6 * packed.hinge_position[owner] + kind.columns.start + k

    def _end_slot(self, owner: str, quantity: str) -> Slot | None:
        reference = self._references.canonical(owner)
        kind, k = BODY_COMPONENTS.get(quantity, (None, 0))
        if reference is None or kind is None or not kind.part:
            return None
        probe = self._probes.setdefault(reference, len(self._probes))
        width = int(self._engine.lib.MSTMM_PROBE_NUMBERS)
        return kind.part, width * probe + kind.columns.start + k

    def evaluate(self, run: Any, t: float, y: Array) -> Array:
        """Values (numbers,) at time t (s) and state y (n_state,); `run` is a `mstmm_scene_run *`.

        Raises NumericalFailure where the state cannot be evaluated.
        """
        values, state = np.zeros(max(1, self.numbers)), np.ascontiguousarray(y)
        pointers = self._engine.pointer(state), self._engine.pointer(values)
        if self._engine.lib.mstmm_evaluate_measure(run, self.record, t, *pointers):
            raise NumericalFailure(self._engine.failure_text(run.failure, t))
        return values[: self.numbers]


def reject_one_way(packed: PackedScene, where: str) -> None:
    """Raise SceneError for one-way bodies, whose deflection is only known after the run."""
    rigidified = packed.expanded.rigidified
    for name in rigidified.one_way if rigidified is not None else ():
        raise SceneError(
            f'"{name}": {where} cannot use a body with model = "one-way", because its deflection '
            'is computed after the run; use model = "flexible" or "rigid"'
        )


class MeasuredOutputs:
    """Outputs of a scene that C evaluates; `others` are the names of the remaining outputs."""

    def __init__(self, engine: LoopedEngine) -> None:
        self.remaining_names, self._sizes = list[str](), dict[str, int]()
        expressions = list[Expression]()
        for output in engine.packed.user_scene.output:
            components = _output_expressions(engine, output)
            expressions += components
            self._sizes[output.name] = len(components)
            self.remaining_names += [] if components else [output.name]
        self._measured = MeasuredQuantities(engine, expressions)

    def evaluate(self, run: Any, t: float, y: Array) -> dict[str, Any]:
        """Output name -> number or vector (3,) at time t (s) and state y (n_state,)."""
        values, outputs, first = self._measured.evaluate(run, t, y), dict[str, Any](), 0
        for name, size in self._sizes.items():
            if size:
                components = values[first : first + size]
                outputs[name] = float(components[0]) if size == 1 else components
            first += size
        return outputs


def _output_expressions(engine: LoopedEngine, output: Output) -> list[Expression]:
    """Expressions of an output, one per component; empty where C cannot evaluate it."""
    for labels in ([""], [".x", ".y", ".z"]):
        try:
            expressions = [output.of] if labels == [""] else [
                parse(output.of.text + label) for label in labels
            ]  # fmt: skip
            MeasuredQuantities(engine, expressions)
        except (SceneError, ExpressionError):  # a component of a sum is no expression
            continue
        return expressions
    return []


class Controllers:
    """`records`: `mstmm_controller[]` of a scene with `count` entries.

    The object owns all memory that the records point to.  Raises SceneError with the name of the
    controller for an input that a run cannot measure.
    """

    def __init__(self, engine: LoopedEngine) -> None:
        scene, ffi = engine.packed.user_scene, engine.ffi
        self.count = len(scene.controller)
        reject_one_way(engine.packed, f'controller "{scene.controller[0].name}"')
        self.records = ffi.new("mstmm_controller[]", self.count)
        self._keep_alive: list[Any] = []
        memory_offset = engine.packed.system.held_inputs.first
        output_names = [output.name for output in scene.output]
        for record, controller in zip(self.records, scene.controller, strict=True):
            try:
                expressions = [measured_expression(scene, name) for name in controller.inputs]
                measured = MeasuredQuantities(engine, expressions, output_names)
            except SceneError as error:
                raise SceneError(f'controller "{controller.name}": inputs: {error}') from None
            record.sample_time, record.memory = controller.sample_time, memory_offset
            record.measure = measured.record
            record.n_x, record.n_y = len(controller.A), len(controller.inputs)
            record.n_u = len(controller.outputs)
            arrays = {
                key: np.array([*row, 0.0]) for key, row in controller.complete_matrices.items()
            }
            for key in ("A", "B", "C", "D", "reference", "offset"):
                setattr(record, key, engine.pointer(arrays[key]))
            scratch = np.zeros(record.n_y + 1), np.zeros(record.n_x + 1)
            record.y, record.next = map(engine.pointer, scratch)
            self._keep_alive += [measured, *arrays.values(), *scratch]
            memory_offset += 1 + record.n_x + record.n_u


def measured_expression(scene: SceneTables, name: str) -> Expression:
    """Expression of an output of the scene, of a component of an output, or of a quantity."""
    for output in scene.output:
        if name == output.name:
            return output.of
        if name.startswith(f"{output.name}."):
            return parse(output.of.text + name.removeprefix(output.name))
    return parse(name)
