"""Interpreter of the schedule on one graph: calls are inlined and zeros fold."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from fractions import Fraction

from mstmm.abi.failure_codes import FailureCode
from mstmm.errors import ElementError
from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import BodyStructure, CouplingStructure, ExpressionStructure, Key

from ..schedule.forward_kinematics import POSES
from ..schedule.pass_steps import (
    TIPS_TO_ROOT,
    Add,
    ByScrew,
    Call,
    CheckPivots,
    ChooseBias,
    Copy,
    EachSpeed,
    Evaluate,
    ForEach,
    Gather,
    Move,
    Pass,
    RunPass,
    ScatterSpeeds,
    SelectColumns,
    Step,
    Sweep,
)
from ..schedule.slot_definitions import SLOTS
from .constraint_slots import RowSlots, closure_at, coupling_inputs, row_subject
from .fusion_state import FusionState, along_a_screw, screw_axis, unit_row
from .slot_values import GROUND, Subject

#: Lengths of local slots that are initialised with zeros.
_LOCAL_SIZES = {"local.e_I": 6, "local.S_I": 21, "local.effort": 1}
#: Least ratio of a pivot to the mean inertia of the body that it moves.
PIVOT_FLOOR = Fraction(1, 10**14)


class ScheduleInterpreter(RowSlots):
    """Evaluation of sweeps on one graph.

    `staged`: transport stage by stage, so that known values fold; `inverse`: accelerations are
    given; `refined`: accelerations are a solution of the tree to which that of the residual is
    added; `level`: corrected quantity of closed loops, "position_gap" or "velocity_error"; `way`:
    evaluate only these bodies, all with poses.
    """

    def __init__(
        self, state: FusionState, staged: bool = True, inverse: bool = False, level: str = "",
        refined: bool = False, way: Collection[int] | None = None,
    ) -> None:  # fmt: skip
        super().__init__(state)
        self.staged, self.inverse, self.level = staged, inverse or refined, level
        self.refined = refined
        #: Guard conditions, for code without failure codes that needs their conjunction.
        self.conditions: list[Node] = []
        self._values: Nodes = []
        #: Errors of couplings at the current level.
        self.lacks: list[tuple[CouplingStructure, Node]] = []
        self._bodies_visited = range(len(state.structure.bodies)) if way is None else sorted(way)
        self._bodies_posed = self._bodies_with_poses() if way is None else set(way)

    # --- passes ---------------------------------------------------------------------------------

    def sweep(self, sweep: Sweep) -> None:
        """Evaluate all passes of a sweep."""
        for run in sweep.runs:
            if not all(self._scene_has(trait) == required for trait, required in run.traits):
                continue
            if run.whole is None:
                getattr(self, f"_{run.hook}")()
            else:
                self._pass(run.whole)

    def _pass(self, body_pass: Pass) -> None:
        subjects = self._subjects(body_pass)
        for subject in reversed(subjects) if body_pass.order == TIPS_TO_ROOT else subjects:
            self.enter(subject)
            if not (body_pass.skip and self._is_true(body_pass.skip)):
                self.steps(body_pass.steps)

    def _subjects(self, body_pass: Pass) -> list[Subject]:
        s = self.state.structure
        if body_pass.subject == "body":
            return [
                self.body_subject(i)
                for i in self._bodies_visited
                if body_pass is not POSES or i in self._bodies_posed
            ]
        if body_pass.subject == "row":
            return [row_subject(s.rows, i) for i, row in enumerate(s.rows) if row.body == GROUND]
        if body_pass.subject == "coupling":
            return [Subject({"body": GROUND}, row=coupling.row) for coupling in s.couplings]
        if body_pass.subject == "law":
            return [Subject({"body": x.body}, law=x, index=i) for i, x in enumerate(s.laws)]
        if body_pass.subject == "load":
            return [
                Subject({"body": x.body, "on": x.body, "axes": x.axes}, load=x, index=i)
                for i, x in enumerate(s.loads)
            ]
        if body_pass.subject == "force":
            return [
                Subject({"body": GROUND, "from": x.body_f, "to": x.body_t}, force=x, index=i)
                for i, x in enumerate(s.forces)
            ]
        if body_pass.subject == "drive":
            return [Subject({"body": body}, index=k) for k, (body, _) in enumerate(s.driven)]
        return [Subject({"body": GROUND}, index=k) for k in range(s.nu)]

    def body_subject(self, index: int) -> Subject:
        s, closure = self.state.structure, closure_at(self.state.structure, index)
        roles = {"body": index, "parent": s.bodies[index].parent}
        return Subject(roles if closure is None else roles | {"outboard": closure.outboard})

    def _bodies_with_poses(self) -> set[int]:
        """Bodies whose poses loads, forces or closures need, and their inboard bodies."""
        s = self.state.structure
        indices = [x for load in s.loads for x in (load.body, load.axes)]
        indices += [x for force in s.forces for x in (force.body_f, force.body_t)]
        indices += [i for i, body in enumerate(s.bodies) if body.modal and body.modal.drag]
        indices += [x for closure in s.closures for x in (closure.frame, closure.outboard)]
        posed: set[int] = set()
        for index in indices:
            while index >= 0 and index not in posed:
                posed.add(index)
                index = s.bodies[index].parent
        return posed

    # --- the scene's expressions ----------------------------------------------------------------

    def _drive_values(self) -> None:
        s = self.state.structure
        assert s.drives is not None
        flat = self.state.expression(s.drives)
        for k, (index, _) in enumerate(s.driven):
            self.enter(Subject({"body": index}, index=k))
            for i, name in enumerate(("value", "rate", "acceleration")):
                self.fill(f"drive.{name}", [flat[3 * k + i]])

    def _expression_values(self) -> None:
        values = self.state.structure.values
        assert values is not None
        self._values = self.state.expression(values)

    # --- traits ---------------------------------------------------------------------------------

    def _is_true(self, when: str) -> bool:
        return all(
            self._has(word.lstrip("!")) == (not word.startswith("!")) for word in when.split()
        )

    def _scene_has(self, trait: str) -> bool:
        s = self.state.structure
        traits = {
            "linked": False, "product": False, "qr": False,
            "refined": self.refined, "residual": self.refined,
            "couplings": bool(s.couplings), "looped": s.closes, "balance": not self.level,
            "efforts": True, "inverse": self.inverse, "weightless": False,
            "driving": not self.level,
            "laws": bool(s.laws), "driven": s.drives is not None,
            "expressions": s.values is not None, "poses": bool(self._bodies_posed),
            "flexible": any(body.modal for body in s.bodies),
        }  # fmt: skip
        return traits[trait]

    def _has(self, trait: str) -> bool:
        """Whether the subject has a trait; see `schedule.slot_definitions`."""
        if trait in ("balance", "efforts", "inverse", "weightless", "driving", "refined"):
            return self._scene_has(trait)
        if trait in ("position_gap", "velocity_error"):
            return self.level == trait
        if trait == "coordinate":
            return self.subject.law is not None and not self.subject.law.axes
        if trait == "redundant":
            return self.subject.row < 0
        if trait == "effort":
            return self.subject.force is not None and self.subject.force.effort is not None
        return _TRAITS[trait](self, self.body)

    def free_speeds(self) -> list[int]:
        """Speeds of the current hinge that are not prescribed."""
        return [k for k in range(self.body.nu) if not self.body.imposed[k]]

    def has_own_elimination(self) -> bool:
        """Whether the hinge's own elimination applies; old definitions have none."""
        body = self.body
        if any(body.imposed) or any(x.value != 0 for x in self.get("body.rotor", 0)):
            return False
        try:
            self.state.kernels(body.hinge, "eliminate")
        except ElementError:
            return False
        return True

    # --- steps ----------------------------------------------------------------------------------

    def steps(self, steps: Iterable[Step]) -> None:
        """Execute steps of a pass for the current subject."""
        for step in steps:
            if not step.when or self._is_true(step.when):
                _EXECUTE[type(step)](self, step)

    def _run_steps(self, step: RunPass) -> None:
        assert step.whole is not None
        self.steps(step.whole.steps)

    def _for_each(self, step: ForEach) -> None:
        at, local = self.subject, self.local
        for subject in self.subjects(step.of):
            self.subject = subject
            self.steps(_with_entry(inner, "c", subject.direction) for inner in step.steps)
        self.subject, self.local = at, local

    def _begin_rows(self) -> None:
        """Compute the errors of couplings; other row slots are initialised on first use."""
        self.lacks = list(coupling_inputs(self))

    def _apply_impact(self) -> None:
        """Do nothing: impacts are computed by the looped engine only."""

    def _set_row_targets(self) -> None:
        """Do nothing: rows have no target beyond closure."""

    def _run_kernel(self, step: Call) -> None:
        kernel, ports = self._kernel(step.kernel), dict(step.ports)
        n = self.modal.n if kernel.size_symbol else 0
        sizes = {port.name: port.length(n) for port in kernel.inputs}
        arguments = {name: self.get(ports[name], size)[:size] for name, size in sizes.items()}
        results = self.state.inline.run(kernel, arguments, self._guard(step.fails), n=n)
        for port in kernel.outputs:
            if port.name in ports:
                self._store(ports[port.name], port, results[port.name])

    def _store(self, slot: str, port: Port, nodes: Nodes) -> None:
        if port.accumulate:
            old = self.get(slot, len(nodes))
            nodes = [a + b for a, b in zip(old, nodes, strict=True)]
        self.fill(slot, nodes)

    def _kernel(self, name: str) -> KernelIR:
        element, _, kernel = name.partition(".")
        key: Key = ("sweep", element)
        if element in ("hinge", "body"):
            key = getattr(self.body, element)
        elif element == "law":
            assert self.subject.law is not None
            key, kernel = ("sweep", "laws"), self.subject.law.kernel
        elif element == "force":
            assert self.subject.force is not None
            key = self.subject.force.element
        elif element.startswith("generic{"):
            count = self.body.nu if element == "generic{nu}" else len(self.free_speeds())
            key = ("sweep", f"generic{count}")
        return self.state.kernels(key, kernel)

    def _guard(self, reason: str) -> Callable[[Node, int], None] | None:
        if not reason:
            return None
        element = self.index if self.index >= 0 else self.subject.index

        def guard(condition: Node, code: int) -> None:
            if not self.staged:
                self.conditions.append(condition)
                return
            positive = condition.op == "lt" and condition.args[0].value == 0
            # `_check_pivots` applies a stricter limit to these pivots.
            if not (positive and reason == "undetermined"):
                self.state.fail_unless(condition, int(FailureCode[reason.upper()]), element, code)

        return guard

    def _copy(self, step: Copy | Move) -> None:
        if step.source:
            self.fill(step.to, list(self.get(step.source, 0)))
        else:
            self.fill(step.to, self.state.zeros(self._size(step.to)))

    def _size(self, slot: str) -> int:
        """Length of a slot that is filled with zeros."""
        if slot in _LOCAL_SIZES:
            return _LOCAL_SIZES[slot]
        _, _, entries = slot.partition("[")
        if entries:
            return len(entries.split())
        factors = SLOTS[slot].size.split()
        sizes = {"nu": self.body.nu, "n": self.modal.n if "n" in factors else 0}
        return math.prod(sizes[x] if x in sizes else int(x) for x in factors)

    def _add(self, step: Add) -> None:
        terms = self.get(step.source, 0)
        for _ in range(abs(step.times) - 1):
            terms = [a + b for a, b in zip(terms, self.get(step.source, 0), strict=True)]
        if step.to == "law.tau":
            law = self.subject.law
            assert law is not None
            self._add_at("body.tau", law.speed, terms)
            return
        old = self.get(step.to, len(terms))
        if step.times < 0:
            self.fill(step.to, [a - b for a, b in zip(old, terms, strict=True)])
        else:
            self.fill(step.to, [a + b for a, b in zip(old, terms, strict=True)])

    def _add_at(self, slot: str, first: int, terms: Nodes) -> None:
        nodes = list(self.get(slot, 0))
        for k, term in enumerate(terms, first):
            nodes[k] = nodes[k] + term
        self.fill(slot, nodes)

    def _select_columns(self, step: SelectColumns) -> None:
        source, nu = self.get(step.source, 0), self.body.nu
        selected = [source[row * nu + k] for row in range(step.rows) for k in self.free_speeds()]
        self.fill(step.to, selected)

    def _scatter_speeds(self, step: ScatterSpeeds) -> None:
        free, nu = self.free_speeds(), self.body.nu
        values = self.get(step.imposed, nu) if step.imposed else self.state.zeros(nu)
        rates = self.get(step.free, len(free)) if free else []
        values = list(values)
        for k, rate in zip(free, rates, strict=True):
            values[k] = rate
        self.fill(step.to, values)

    def _gather(self, step: Gather) -> None:
        owner, _, name = step.places.partition(".")
        indices: tuple[int, ...] = getattr(getattr(self.subject, owner), name)
        values = [self._values[index] if index >= 0 else self.state.zero for index in indices]
        self.fill(step.to, values)

    def _evaluate(self, step: Evaluate) -> None:
        owner, _, name = step.expression.partition(".")
        expression: ExpressionStructure = getattr(getattr(self.subject, owner), name)
        inputs = {port: self.get(slot, 0) for port, slot in step.given}
        self.fill(step.to, self.state.expression(expression, **inputs))

    def _each_speed(self, step: EachSpeed) -> None:
        for k in range(self.body.nu):
            if self.body.imposed[k] or not step.imposed:
                self.steps(_with_entry(inner, "k", k) for inner in step.steps)

    def _by_screw(self, step: ByScrew) -> None:
        rotation, position = self.get(step.rotation, 9), self.get(step.position, 3)
        axis = screw_axis(rotation, position)
        if axis:
            self.steps(step.about_x if axis == "x" else step.about_z)
        elif all(entry.value is None for entry in rotation):
            self.steps(step.turning)
        else:
            self.steps(step.otherwise)

    def _choose_bias(self, step: ChooseBias) -> None:
        """Cancel the bias motion along free unit directions.

        Rotors are skipped, because their effort depends on all of udot.
        """
        body, nu = self.body, self.body.nu
        if any(body.imposed) or any(isinstance(x, int) or x != 0.0 for x in body.rotor):
            return
        subspace, motion = self.get(step.subspace, 0), list(self.get(step.motion, 9))
        offset = self.state.zeros(nu)
        for k in range(nu):
            row = unit_row(subspace[k::nu])
            if row is not None:
                entry = row + 6 if row < 3 else row  # motion is w, wd, rdd
                offset[k] = -motion[entry]
                motion[entry] = self.state.zero
        self.fill(step.motion, motion)
        self.fill(step.offset, offset)

    def _check_pivots(self, step: CheckPivots) -> None:
        """Guard pivots relative to the body's own inertia, or the composite one if zero."""
        graph, count = self.state.graph, len(self.free_speeds())
        own, composite = self.get(step.own, 21), self.get(step.whole, 21)
        columns = self.get(step.subspace, 6 * count)
        mass, inertia = (
            graph.constant(PIVOT_FLOOR / 3) * _own_or_composite(own, composite, entries)
            for entries in ((0, 6, 11), (15, 18, 20))
        )
        for i, pivot in enumerate(self.get(step.pivots, count)):
            moves = any(x.value != 0 for x in columns[i::count][:3])
            condition = graph.call("lt", mass if moves else inertia, pivot)
            self.state.fail_unless(condition, int(FailureCode[step.fails.upper()]), self.index, 1)


def _own_or_composite(own: Nodes, composite: Nodes, entries: tuple[int, int, int]) -> Node:
    a, b, c = entries
    total = own[a] + own[b] + own[c]
    return total if total.value != 0 else composite[a] + composite[b] + composite[c]


def _with_entry(step: Step, letter: str, index: int) -> Step:
    """Step with the entry `index` in place of "[k]", row `index` in place of "[6 * k]"."""

    def resolve(slot: str) -> str:
        name, _, entry = slot.partition("[")
        width, times, symbol = entry.rstrip("]").rpartition(" * ")
        if symbol != letter:
            return slot
        first, count = (int(width) * index, int(width)) if times else (index, 1)
        return f"{name}[{' '.join(map(str, range(first, first + count)))}]"

    if isinstance(step, Call):
        return replace(step, ports=tuple((port, resolve(slot)) for port, slot in step.ports))
    if isinstance(step, (Add, Copy, Move)):
        return replace(step, to=resolve(step.to), source=resolve(step.source))
    return step


def _is_axial(replay: ScheduleInterpreter, body: BodyStructure) -> bool:
    rotation, position = replay.get("hinge.R", 9), replay.get("hinge.d", 3)
    return along_a_screw(rotation, position, replay.get("hinge.H", 0) if body.nu else [])


_TRAITS: dict[str, Callable[[ScheduleInterpreter, BodyStructure], bool]] = {
    "own": lambda replay, body: False,
    "parts": lambda replay, body: True,
    "whole": lambda replay, body: False,
    "staged": lambda replay, body: replay.staged,
    "axial": _is_axial,
    "special": lambda replay, body: replay.has_own_elimination(),
    "free": lambda replay, body: bool(replay.free_speeds()),
    "imposed": lambda replay, body: any(body.imposed),
    "on_body": lambda replay, body: body.parent >= 0,
    "link": lambda replay, body: bool(body.link),
    "rotated": lambda replay, body: bool(body.link) and body.link[3] != 0.0,
    "idle": lambda replay, body: body.idle,
    "modal": lambda replay, body: body.modal is not None,
    "section": lambda replay, body: body.section is not None,
    "outward": lambda replay, body: body.section is not None and not body.section.inward,
    "segment": lambda replay, body: body.section is not None and body.section.is_segment,
    "drag": lambda replay, body: body.modal is not None and bool(body.modal.drag),
    "moving": lambda replay, body: body.section is None and bool(replay.free_speeds()),
    "cut": lambda replay, body: replay.closure() is not None,
    "omitted": lambda replay, body: body.idle or replay.closure() is not None,
    "coupled": lambda replay, body: replay.is_coupled(),
    "hinged": lambda replay, body: replay.has_closure("hinge"),
    "distance": lambda replay, body: replay.has_closure("distance"),
    "plane": lambda replay, body: replay.has_closure("plane"),
    "rolling": lambda replay, body: replay.has_closure("rolling"),
    "gap_closing": lambda replay, body: False,
    "loads_read": lambda replay, body: not replay.level,
    "corrected": lambda replay, body: bool(replay.level),
    "soft": lambda replay, body: bool(replay.row().soft),
    "inside": lambda replay, body: replay.row().body >= 0,
    "immobile": lambda replay, body: replay.is_inactive(),
}

_EXECUTE: dict[type, Callable[..., None]] = {
    RunPass: ScheduleInterpreter._run_steps,
    Call: ScheduleInterpreter._run_kernel,
    Copy: ScheduleInterpreter._copy,
    Add: ScheduleInterpreter._add,
    ForEach: ScheduleInterpreter._for_each,
    Move: ScheduleInterpreter._copy,
    SelectColumns: ScheduleInterpreter._select_columns,
    ScatterSpeeds: ScheduleInterpreter._scatter_speeds,
    Gather: ScheduleInterpreter._gather,
    Evaluate: ScheduleInterpreter._evaluate,
    EachSpeed: ScheduleInterpreter._each_speed,
    ByScrew: ScheduleInterpreter._by_screw,
    ChooseBias: ScheduleInterpreter._choose_bias,
    CheckPivots: ScheduleInterpreter._check_pivots,
}
