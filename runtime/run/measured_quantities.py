"""What a state shows, by C: expressions of quantities that a run can look at as it goes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import ExpressionError, NumericalFailure, SceneError
from mstmm.expression.expression import Expression, Name, parse
from mstmm.expression.inputs import input_node
from mstmm.ir import Port
from mstmm.ir.graph import Graph, Node
from mstmm.ir.tape import compile_tape
from mstmm.scene import Output
from mstmm.scene.validators.validation_messages import did_you_mean

from ..engine.body_references import BodyReferences
from ..engine.engine_calls import Probe
from ..engine.looped_engine import LoopedEngine
from ..engine.observation_columns import (
    BODY_QUANTITIES,
    HINGE_QUANTITIES,
    POINT_COLUMNS,
    SUMS,
    acceleration_name,
    effort_names,
)
from ..kernels.tape_kernel import c_tape
from ..packing.coordinate_layout import HingeSlots
from ..packing.expression_tapes import inputs_port, state_ports
from ..packing.packed_scene import PackedScene, resize_workspace

#: Where a number stands: the port of the tape and the place in it.
Place = tuple[str, int]
_SHOWN = ("points", "loads", "efforts", "udot", "sums")


class MeasuredQuantities:
    """`record` is `mstmm_measure *` of expressions; `numbers` are how many they are.

    `others` are names that could have been given, too.

    Raises SceneError for a name of what a run cannot look at.
    """

    def __init__(
        self, engine: LoopedEngine, expressions: Sequence[Expression], others: Sequence[str] = ()
    ) -> None:
        self._engine, self._graph, self._others = engine, Graph(), others
        self._references = BodyReferences(engine.packed.described.skeleton)
        self._probes: dict[str, int] = {}
        self._read = set[str]()
        nodes = [one.build(self._graph, self._node) for one in expressions]
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
        tape, self._kept = compile_tape(kernel), list[object]()
        resize_workspace(packed, tape.slots)
        self.record = ffi.new("mstmm_measure *")
        self.record.tape, self.record.observes = c_tape(ffi, tape, self._kept), bool(self._read)
        shown = self.record.shown
        for name, n in sizes.items():
            array = np.zeros(max(1, n))
            self._kept.append(array)
            if name in self._read:
                setattr(shown, name, engine.pointer(array))
        records = engine.probes([Probe(*packed.end(one)) for one in self._probes])
        shown.n_probes, shown.probes = len(self._probes), records
        self._kept.append(records)

    def _node(self, name: Name) -> Node:
        graph, inputs = self._graph, self._engine.packed.layout.inputs
        if name.text == "t":
            return graph.element("t", 0)
        if name.text in inputs:
            return input_node(inputs[name.text], graph.element("t", 0))
        if name.text == "energy":
            a, b, c = (self._element(("sums", k)) for k in range(3))
            return a + b + c
        place = self._of_scene(name.text) or self._of_owner(name.text)
        if place is None:
            raise SceneError(
                f'"{name.text}": this cannot be looked at within a run{self._meant(name.text)}; '
                "of hinges there are coordinates, speeds, accelerations, efforts, components of "
                "force and moment, of bodies and ends components of position, velocity, "
                "acceleration and of their turning (no quaternions), of the scene energies, power "
                "and momenta"
            )
        return self._element(place)

    def _meant(self, text: str) -> str:
        """The nearest of the names of coordinates, speeds and others, if one is near."""
        hinges = self._engine.packed.layout.hinges.items()
        known = [f"{owner}.{x}" for owner, one in hinges for x in (*one.q_names, *one.u_names)]
        found = did_you_mean(text, [*self._others, *known])
        return found if "did you mean" in found else ""

    def _element(self, place: Place) -> Node:
        if place[0] in _SHOWN:
            self._read.add(place[0])
        return self._graph.element(*place)

    def _of_scene(self, text: str) -> Place | None:
        for name, (_, _, columns) in SUMS.items():
            if text == name and columns.stop == columns.start + 1:
                return "sums", columns.start
            if columns.stop == columns.start + 3 and text.startswith(f"{name}."):
                label = text.removeprefix(f"{name}.")
                if label in ("x", "y", "z"):
                    return "sums", columns.start + "xyz".index(label)
        return None

    def _of_owner(self, text: str) -> Place | None:
        parts = text.split(".")
        packed = self._engine.packed
        for k in range(len(parts) - 1, 0, -1):
            owner, rest = ".".join(parts[:k]), ".".join(parts[k:])
            slots = packed.layout.hinges.get(owner) or packed.layout.modal.get(owner)
            place = None if slots is None else self._of_hinge(slots, owner, rest)
            reference = self._references.canonical(owner)
            if place is None and reference is not None:
                place = self._of_end(reference, rest)
            if place is not None:
                return place
        return None

    def _of_hinge(self, slots: HingeSlots, owner: str, rest: str) -> Place | None:
        groups = [("q", "q", slots.q, slots.q_names), ("u", "u", slots.u, slots.u_names)]
        rates = [acceleration_name(name) for name in slots.u_names]
        groups.append(("udot", "udot", slots.u, tuple(rates)))
        modal = owner in self._engine.packed.layout.modal
        if not modal:
            efforts = tuple(effort_names(slots.u_names))
            groups.append(("efforts", "effort", slots.u, efforts))
        for port, short, first, names in groups:
            known = [*names, *(f"{short}[{k}]" for k in range(len(names)))]
            known += [short] if len(names) == 1 else []
            if rest in known:
                return port, first + known.index(rest) % len(names)
        if modal:
            return None
        body = self._engine.packed.hinge_position[owner]
        for first, (kind, about) in enumerate(HINGE_QUANTITIES.items()):
            for axis, label in enumerate(about.labels):
                if rest in (f"{kind}.{label}", about.short[axis]):
                    return "loads", 6 * body + 3 * first + axis
        return None

    def _of_end(self, reference: str, rest: str) -> Place | None:
        for kind, columns in POINT_COLUMNS.items():
            about = BODY_QUANTITIES[kind]
            for axis, label in enumerate(about.labels):
                if rest in (f"{kind}.{label}", about.short[axis]):
                    probe = self._probes.setdefault(reference, len(self._probes))
                    width = int(self._engine.lib.MSTMM_PROBE_NUMBERS)
                    return "points", width * probe + columns.start + axis
        return None

    def at(self, run: Any, t: float, y: Array) -> Array:
        """The numbers at a state y (n_state,) of a scene's run, `mstmm_scene_run *`."""
        found, state = np.zeros(max(1, self.numbers)), np.ascontiguousarray(y)
        pointers = self._engine.pointer(state), self._engine.pointer(found)
        if self._engine.lib.mstmm_measured(run, self.record, t, *pointers):
            raise NumericalFailure(self._engine.failure_text(run.failure, t))
        return found[: self.numbers]


def refuse_one_way(packed: PackedScene, what: str) -> None:
    """SceneError for bodies whose deflection is found behind a whole run: within one there is
    nothing of it to see."""
    rigidified = packed.expanded.rigidified
    for name in rigidified.one_way if rigidified is not None else ():
        raise SceneError(
            f'"{name}": {what} sees nothing of the deflection of a body with model = "one-way", '
            'which is found behind a whole run; take model = "flexible" or "rigid"'
        )


class MeasuredOutputs:
    """The outputs of a scene that C gives; `others` are the names of those that it does not."""

    def __init__(self, engine: LoopedEngine) -> None:
        self.others, self._labels = list[str](), dict[str, int]()
        expressions = list[Expression]()
        for output in engine.packed.described.output:
            found = _of_output(engine, output)
            expressions += found
            self._labels[output.name] = len(found)
            self.others += [] if found else [output.name]
        self._measured = MeasuredQuantities(engine, expressions)

    def at(self, run: Any, t: float, y: Array) -> dict[str, Any]:
        """Numbers, and arrays of vectors, by the names of outputs."""
        numbers, found, first = self._measured.at(run, t, y), dict[str, Any](), 0
        for name, count in self._labels.items():
            if count:
                part = numbers[first : first + count]
                found[name] = float(part[0]) if count == 1 else part
            first += count
        return found


def _of_output(engine: LoopedEngine, output: Output) -> list[Expression]:
    """What gives an output: an expression, or one for each component; none where C does not."""
    for labels in ([""], [".x", ".y", ".z"]):
        try:
            found = [output.of] if labels == [""] else [
                parse(output.of.text + label) for label in labels
            ]  # fmt: skip
            MeasuredQuantities(engine, found)
        except (SceneError, ExpressionError):  # a component of a sum is no expression
            continue
        return found
    return []
