"""The schedule replayed on the nodes of one graph: every call inlined, every zero folding."""

from __future__ import annotations

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
from .fusion_state import FusionState
from .kernel_selection import along_a_screw, screw_axis, unit_row
from .slot_values import GROUND, Subject

#: Lengths of the local slots that start from zeros.
_LOCAL_SIZES = {"local.e_I": 6, "local.S_I": 21, "local.effort": 1}
#: A pivot must exceed this share of the mean inertia of the body it moves.
PIVOT_FLOOR = Fraction(1, 10**14)


class ScheduleInterpreter(RowSlots):
    """One replay of sweeps.  `staged`: transport goes stage by stage, where what is known folds;
    `inverse`: accelerations are given; `refined`: they are an answer of a tree, to which that of
    what they leave over is added; `level`: "gaping" or "slipping", what is corrected of closed
    loops; `way`: the only bodies that are met, all with poses."""

    def __init__(
        self, state: FusionState, staged: bool = True, inverse: bool = False, level: str = "",
        refined: bool = False, way: Collection[int] | None = None,
    ) -> None:  # fmt: skip
        super().__init__(state)
        self.staged, self.inverse, self.level = staged, inverse or refined, level
        self.refined = refined
        #: Conditions of guards, which code without failure codes asks for as a whole.
        self.conditions: list[Node] = []
        self._values: Nodes = []
        #: What couplings lack.
        self.lacks: list[tuple[CouplingStructure, Node]] = []
        self._met = range(len(state.structure.bodies)) if way is None else sorted(way)
        self._posed = self._bodies_with_poses() if way is None else set(way)

    # --- passes ---------------------------------------------------------------------------------

    def sweep(self, sweep: Sweep) -> None:
        """All passes of a sweep."""
        for run in sweep.runs:
            if not all(self._scene_has(trait) == wanted for trait, wanted in run.traits):
                continue
            if run.whole is None:
                getattr(self, f"_{run.hook}")()
            else:
                self._pass(run.whole)

    def _pass(self, whole: Pass) -> None:
        subjects = self._subjects(whole)
        for subject in reversed(subjects) if whole.order == TIPS_TO_ROOT else subjects:
            self.enter(subject)
            if not (whole.skip and self._holds(whole.skip)):
                self.steps(whole.steps)

    def _subjects(self, whole: Pass) -> list[Subject]:
        s = self.state.structure
        if whole.subject == "body":
            return [
                self.body_subject(i) for i in self._met if whole is not POSES or i in self._posed
            ]
        if whole.subject == "row":
            return [row_subject(s.rows, i) for i, row in enumerate(s.rows) if row.body == GROUND]
        if whole.subject == "coupling":
            return [Subject({"body": GROUND}, row=one.row) for one in s.couplings]
        if whole.subject == "law":
            return [Subject({"body": x.body}, law=x, index=i) for i, x in enumerate(s.laws)]
        if whole.subject == "load":
            return [
                Subject({"body": x.body, "on": x.body, "axes": x.axes}, load=x, index=i)
                for i, x in enumerate(s.loads)
            ]
        if whole.subject == "force":
            return [
                Subject({"body": GROUND, "from": x.body_f, "to": x.body_t}, force=x, index=i)
                for i, x in enumerate(s.forces)
            ]
        if whole.subject == "drive":
            return [Subject({"body": body}, index=k) for k, (body, _) in enumerate(s.driven)]
        return [Subject({"body": GROUND}, index=k) for k in range(s.nu)]

    def body_subject(self, index: int) -> Subject:
        s, closure = self.state.structure, closure_at(self.state.structure, index)
        roles = {"body": index, "parent": s.bodies[index].parent}
        return Subject(roles if closure is None else roles | {"outboard": closure.outboard})

    def _bodies_with_poses(self) -> set[int]:
        """Bodies that loads, force elements and closures need, and those between them and the
        ground."""
        s = self.state.structure
        asked = [x for load in s.loads for x in (load.body, load.axes)]
        asked += [x for force in s.forces for x in (force.body_f, force.body_t)]
        asked += [i for i, body in enumerate(s.bodies) if body.modal and body.modal.drag]
        asked += [x for closure in s.closures for x in (closure.frame, closure.outboard)]
        found: set[int] = set()
        for index in asked:
            while index >= 0 and index not in found:
                found.add(index)
                index = s.bodies[index].parent
        return found

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

    def _holds(self, when: str) -> bool:
        return all(
            self._has(word.lstrip("!")) == (not word.startswith("!")) for word in when.split()
        )

    def _scene_has(self, trait: str) -> bool:
        s = self.state.structure
        known = {
            "linked": False, "product": False, "qr": False,
            "refined": self.refined, "residual": self.refined,
            "couplings": bool(s.couplings), "looped": s.closes, "balance": not self.level,
            "efforts": True, "inverse": self.inverse, "weightless": False,
            "driving": not self.level,
            "laws": bool(s.laws), "driven": s.drives is not None,
            "valued": s.values is not None, "posed": bool(self._posed),
            "flexible": any(body.modal for body in s.bodies),
        }  # fmt: skip
        return known[trait]

    def _has(self, trait: str) -> bool:
        """Whether the subject has a trait; see `schedule.words`."""
        if trait in ("balance", "efforts", "inverse", "weightless", "driving", "refined"):
            return self._scene_has(trait)
        if trait in ("gaping", "slipping"):
            return self.level == trait
        if trait == "coordinate":
            return self.at.law is not None and not self.at.law.axes
        if trait == "unmet":
            return self.at.row < 0
        if trait == "effort":
            return self.at.force is not None and self.at.force.effort is not None
        return _TRAITS[trait](self, self.body)

    def free(self) -> list[int]:
        """Speeds of the hinge at hand that nobody imposes."""
        return [k for k in range(self.body.nu) if not self.body.imposed[k]]

    def own_elimination(self) -> bool:
        """Whether the hinge's own elimination fits; definitions of earlier versions have none."""
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
        """Steps of a pass at the subject at hand."""
        for step in steps:
            if not step.when or self._holds(step.when):
                _DO[type(step)](self, step)

    def _do(self, step: RunPass) -> None:
        assert step.whole is not None
        self.steps(step.whole.steps)

    def _each(self, step: ForEach) -> None:
        at, local = self.at, self.local
        for subject in self.met(step.of):
            self.at = subject
            self.steps(_at_entry(inner, "c", subject.direction) for inner in step.steps)
        self.at, self.local = at, local

    def _rows_begun(self) -> None:
        """Slots of rows begin with what `RowSlots` gives, and those of couplings with numbers."""
        self.lacks = list(coupling_inputs(self))

    def _struck(self) -> None:
        """Nothing: events strike in the looped engine alone."""

    def _rows_asked(self) -> None:
        """Rows are asked for nothing but to be met."""

    def _call(self, step: Call) -> None:
        kernel, ports = self._kernel(step.kernel), dict(step.ports)
        n = self.modal.n if kernel.size_symbol else 0
        sizes = {port.name: port.length(n) for port in kernel.inputs}
        given = {name: self.get(ports[name], size)[:size] for name, size in sizes.items()}
        found = self.state.inline.run(kernel, given, self._guard(step.fails), n=n)
        for port in kernel.outputs:
            if port.name in ports:
                self._put(ports[port.name], port, found[port.name])

    def _put(self, slot: str, port: Port, nodes: Nodes) -> None:
        if port.accumulate:
            before = self.get(slot, len(nodes))
            nodes = [a + b for a, b in zip(before, nodes, strict=True)]
        self.fill(slot, nodes)

    def _kernel(self, name: str) -> KernelIR:
        element, _, kernel = name.partition(".")
        key: Key = ("sweep", element)
        if element in ("hinge", "body"):
            key = getattr(self.body, element)
        elif element == "law":
            assert self.at.law is not None
            key, kernel = ("sweep", "laws"), self.at.law.kernel
        elif element == "force":
            assert self.at.force is not None
            key = self.at.force.element
        elif element.startswith("generic{"):
            count = self.body.nu if element == "generic{nu}" else len(self.free())
            key = ("sweep", f"generic{count}")
        return self.state.kernels(key, kernel)

    def _guard(self, reason: str) -> Callable[[Node, int], None] | None:
        if not reason:
            return None
        element = self.index if self.index >= 0 else self.at.index

        def guard(condition: Node, code: int) -> None:
            if not self.staged:
                self.conditions.append(condition)
                return
            positive = condition.op == "lt" and condition.args[0].value == 0
            if not (positive and reason == "undetermined"):  # pivots are judged more severely
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
        _, _, picked = slot.partition("[")
        if picked:
            return len(picked.split())
        size = SLOTS[slot].size
        if size.isdigit():
            return int(size)
        return self.modal.n if size == "n" else self.body.nu

    def _add(self, step: Add) -> None:
        terms = self.get(step.source, 0)
        for _ in range(abs(step.times) - 1):
            terms = [a + b for a, b in zip(terms, self.get(step.source, 0), strict=True)]
        if step.to == "law.tau":
            law = self.at.law
            assert law is not None
            self._add_at("body.tau", law.speed, terms)
            return
        before = self.get(step.to, len(terms))
        if step.times < 0:
            self.fill(step.to, [a - b for a, b in zip(before, terms, strict=True)])
        else:
            self.fill(step.to, [a + b for a, b in zip(before, terms, strict=True)])

    def _add_at(self, slot: str, first: int, terms: Nodes) -> None:
        whole = list(self.get(slot, 0))
        for k, term in enumerate(terms, first):
            whole[k] = whole[k] + term
        self.fill(slot, whole)

    def _pick(self, step: SelectColumns) -> None:
        source, nu = self.get(step.source, 0), self.body.nu
        picked = [source[row * nu + k] for row in range(step.rows) for k in self.free()]
        self.fill(step.to, picked)

    def _spread(self, step: ScatterSpeeds) -> None:
        free, nu = self.free(), self.body.nu
        found = self.get(step.imposed, nu) if step.imposed else self.state.zeros(nu)
        rates = self.get(step.free, len(free)) if free else []
        found = list(found)
        for k, rate in zip(free, rates, strict=True):
            found[k] = rate
        self.fill(step.to, found)

    def _gather(self, step: Gather) -> None:
        owner, _, name = step.places.partition(".")
        places: tuple[int, ...] = getattr(getattr(self.at, owner), name)
        values = [self._values[place] if place >= 0 else self.state.zero for place in places]
        self.fill(step.to, values)

    def _evaluate(self, step: Evaluate) -> None:
        owner, _, name = step.expression.partition(".")
        expression: ExpressionStructure = getattr(getattr(self.at, owner), name)
        more = {port: self.get(slot, 0) for port, slot in step.given}
        self.fill(step.to, self.state.expression(expression, **more))

    def _each_speed(self, step: EachSpeed) -> None:
        for k in range(self.body.nu):
            if self.body.imposed[k] or not step.imposed:
                self.steps(_at_entry(inner, "k", k) for inner in step.steps)

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
        """Not with rotor inertia, whose effort goes with the whole acceleration."""
        body, nu = self.body, self.body.nu
        if any(body.imposed) or any(isinstance(x, int) or x != 0.0 for x in body.rotor):
            return
        subspace, motion = self.get(step.subspace, 0), list(self.get(step.motion, 9))
        chosen = self.state.zeros(nu)
        for k in range(nu):
            row = unit_row(subspace[k::nu])
            if row is not None:
                place = row + 6 if row < 3 else row  # motion is w, wd, rdd
                chosen[k] = -motion[place]
                motion[place] = self.state.zero
        self.fill(step.motion, motion)
        self.fill(step.chosen, chosen)

    def _judge_pivots(self, step: CheckPivots) -> None:
        """The body's own inertia counts; all that hangs on it where it has none."""
        graph, count = self.state.graph, len(self.free())
        own, whole = self.get(step.own, 21), self.get(step.whole, 21)
        columns = self.get(step.subspace, 6 * count)
        mass, inertia = (
            graph.constant(PIVOT_FLOOR / 3) * _total(own, whole, places)
            for places in ((0, 6, 11), (15, 18, 20))
        )
        for i, pivot in enumerate(self.get(step.pivots, count)):
            moves = any(x.value != 0 for x in columns[i::count][:3])
            condition = graph.call("lt", mass if moves else inertia, pivot)
            self.state.fail_unless(condition, int(FailureCode[step.fails.upper()]), self.index, 1)


def _total(own: Nodes, whole: Nodes, places: tuple[int, int, int]) -> Node:
    a, b, c = places
    total = own[a] + own[b] + own[c]
    return total if total.value != 0 else whole[a] + whole[b] + whole[c]


def _at_entry(step: Step, letter: str, number: int) -> Step:
    """The step with the entry `number` in place of "[k]", row `number` in place of "[6 * k]"."""

    def at(slot: str) -> str:
        name, _, place = slot.partition("[")
        width, times, found = place.rstrip("]").rpartition(" * ")
        if found != letter:
            return slot
        first, count = (int(width) * number, int(width)) if times else (number, 1)
        return f"{name}[{' '.join(map(str, range(first, first + count)))}]"

    if isinstance(step, Call):
        return replace(step, ports=tuple((port, at(slot)) for port, slot in step.ports))
    if isinstance(step, (Add, Copy, Move)):
        return replace(step, to=at(step.to), source=at(step.source))
    return step


def _axial(replay: ScheduleInterpreter, body: BodyStructure) -> bool:
    rotation, position = replay.get("hinge.R", 9), replay.get("hinge.d", 3)
    return along_a_screw(rotation, position, replay.get("hinge.H", 0) if body.nu else [])


_TRAITS: dict[str, Callable[[ScheduleInterpreter, BodyStructure], bool]] = {
    "own": lambda replay, body: False,
    "parts": lambda replay, body: True,
    "whole": lambda replay, body: False,
    "staged": lambda replay, body: replay.staged,
    "axial": _axial,
    "special": lambda replay, body: replay.own_elimination(),
    "free": lambda replay, body: bool(replay.free()),
    "imposed": lambda replay, body: any(body.imposed),
    "hung": lambda replay, body: body.parent >= 0,
    "link": lambda replay, body: bool(body.link),
    "turned": lambda replay, body: bool(body.link) and body.link[3] != 0.0,
    "idle": lambda replay, body: body.idle,
    "modal": lambda replay, body: body.modal is not None,
    "section": lambda replay, body: body.section is not None,
    "outward": lambda replay, body: body.section is not None and not body.section.inward,
    "drag": lambda replay, body: body.modal is not None and bool(body.modal.drag),
    "moving": lambda replay, body: body.section is None and bool(replay.free()),
    "cut": lambda replay, body: replay.closure() is not None,
    "aside": lambda replay, body: body.idle or replay.closure() is not None,
    "coupled": lambda replay, body: replay.is_coupled(),
    "hinged": lambda replay, body: replay.closed_by("hinge"),
    "distance": lambda replay, body: replay.closed_by("distance"),
    "plane": lambda replay, body: replay.closed_by("plane"),
    "rolling": lambda replay, body: replay.closed_by("rolling"),
    "placing": lambda replay, body: False,
    "kept": lambda replay, body: not replay.level,
    "corrected": lambda replay, body: bool(replay.level),
    "soft": lambda replay, body: bool(replay.row().soft),
    "inside": lambda replay, body: replay.row().body >= 0,
    "unmoved": lambda replay, body: replay.rests(),
}

_DO: dict[type, Callable[..., None]] = {
    RunPass: ScheduleInterpreter._do,
    Call: ScheduleInterpreter._call,
    Copy: ScheduleInterpreter._copy,
    Add: ScheduleInterpreter._add,
    ForEach: ScheduleInterpreter._each,
    Move: ScheduleInterpreter._copy,
    SelectColumns: ScheduleInterpreter._pick,
    ScatterSpeeds: ScheduleInterpreter._spread,
    Gather: ScheduleInterpreter._gather,
    Evaluate: ScheduleInterpreter._evaluate,
    EachSpeed: ScheduleInterpreter._each_speed,
    ByScrew: ScheduleInterpreter._by_screw,
    ChooseBias: ScheduleInterpreter._choose_bias,
    CheckPivots: ScheduleInterpreter._judge_pivots,
}
