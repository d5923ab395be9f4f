"""Slots of the schedule as graph nodes: scene data, and outputs of calls."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass

from mstmm.ir.graph import Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import (
    BodyStructure,
    Entries,
    ForceStructure,
    LawStructure,
    LoadStructure,
    ModalStructure,
    rotation_coordinate,
)

from ..schedule.slot_definitions import ROLES
from .fusion_state import FusionState

#: Index of the ground.
GROUND = -1


@dataclass(frozen=True)
class Subject:
    """Current item of a pass: a body (by its roles) and the law, load, force, drive or row.

    `other` and `second` are rows paired with `row`; `direction` is its direction at the
    closure.
    """

    roles: dict[str, int]
    law: LawStructure | None = None
    load: LoadStructure | None = None
    force: ForceStructure | None = None
    index: int = 0
    row: int = -1
    other: int = -1
    second: int = -1
    direction: int = -1


class Slots:
    """Nodes by slot.  `local` slots are cleared when the subject changes."""

    def __init__(self, state: FusionState) -> None:
        self.state = state
        self._nodes_by_slot: dict[Hashable, Nodes] = {}
        self.local: dict[str, Nodes] = {}
        self.subject = Subject({})
        gravity = [-g for g in state.entries(state.structure.gravity)]
        initial = {"A": state.identity(), "motion": [*state.zeros(6), *gravity]}
        sizes = {"x": 3, "v": 3, "delta": 6, "e": 6, "S": 21}
        initial |= {name: state.zeros(size) for name, size in sizes.items()}
        self._nodes_by_slot |= {(GROUND, f"body.{name}"): nodes for name, nodes in initial.items()}
        self._nodes_by_slot[0, "sums.power"] = self._nodes_by_slot[0, "sums.potential"] = [
            state.zero
        ]

    # --- the subject ----------------------------------------------------------------------------

    def enter(self, subject: Subject) -> None:
        """Make `subject` the one that slots refer to."""
        self.subject, self.local = subject, {}

    @property
    def index(self) -> int:
        """Index of the current body."""
        return self.subject.roles["body"]

    @property
    def body(self) -> BodyStructure:
        """Current body."""
        return self.state.structure.bodies[self.index]

    @property
    def frame(self) -> int:
        """Index of the flexible body that the current body belongs to."""
        section = self.body.section
        return self.index if section is None else section.frame

    @property
    def modal(self) -> ModalStructure:
        """Modes that the current body belongs to."""
        modes = self.state.structure.bodies[self.frame].modal
        assert modes is not None
        return modes

    # --- reading and filling --------------------------------------------------------------------

    def get(self, slot: str, length: int) -> Nodes:
        """Nodes of a slot; `length` is the size of a constant."""
        if slot == "identity":
            return self.state.identity()
        if slot in ("zero", "none"):
            return self.state.zeros(length)
        name, _, entries = slot.partition("[")
        nodes = self._all_nodes(name)
        if entries:
            nodes = [nodes[int(index)] for index in entries.rstrip("]").split()]
        return nodes

    def _all_nodes(self, slot: str) -> Nodes:
        if slot.startswith("local."):
            return self.local[slot]
        key = self._key(slot)
        if key not in self._nodes_by_slot:
            self._nodes_by_slot[key] = self._scene_data(slot)
        return self._nodes_by_slot[key]

    def fill(self, slot: str, nodes: Nodes) -> None:
        """Store nodes in a slot, or in the entries named in brackets."""
        name, _, entries = slot.partition("[")
        if entries:
            all_nodes = list(self._all_nodes(name))
            for index, node in zip(entries.rstrip("]").split(), nodes, strict=True):
                all_nodes[int(index)] = node
            nodes = all_nodes
        if name.startswith("local."):
            self.local[name] = nodes
        elif name in ("drive.q", "drive.u", "drive.s"):
            self._store_prescribed(name, nodes[0])
        else:
            self._nodes_by_slot[self._key(name)] = nodes

    def _store_prescribed(self, slot: str, node: Node) -> None:
        """Store a prescribed coordinate, speed or acceleration in the state vectors."""
        f, speed = self.state, self.state.structure.driven[self.subject.index][1]
        if slot == "drive.s":
            self.fill(f"body.s[{speed}]", [node])
        elif slot == "drive.q":
            f.q[self.body.q + speed] = node
        else:
            f.u[self.body.u + speed] = node

    def value(self, index: int, slot: str) -> Nodes | None:
        """Nodes stored in a slot of a body; None if it is empty."""
        return self._nodes_by_slot.get((index, slot))

    def collect(self, name: str) -> Nodes:
        """Slot `name` of all bodies and their modes, in the order of the state."""
        s = self.state.structure
        vector = self.state.zeros(s.nq if name == "qdot" else s.nu)
        for index, body in enumerate(s.bodies):
            first = body.q if name == "qdot" else body.u
            nodes = self.value(index, f"body.{name}") or []
            vector[first : first + len(nodes)] = nodes
            if body.modal is not None:
                first = body.modal.q if name == "qdot" else body.modal.u
                vector[first : first + body.modal.n] = self.value(index, f"modes.{name}") or []
        return vector

    def _key(self, slot: str) -> Hashable:
        owner, _, name = slot.partition(".")
        if slot == "inboard.S_rf":
            return self._inboard_columns()
        if owner in ROLES:
            return self.subject.roles[owner], f"body.{name}"
        if owner in ("modes", "moments", "drag"):
            return self.frame, slot
        if owner in ("sums", "scene"):
            return 0, slot
        if owner in ("law", "load", "force", "drive", "speed"):
            return self.subject.index, slot
        return self.index, slot

    def _inboard_columns(self) -> Hashable:
        """Key of the modal columns at the station before a segment, or of the flexible body."""
        parent = self.subject.roles["parent"]
        if parent == self.frame:
            return self.frame, "modes.S_rf"
        return parent, "section.S_rf"

    # --- scene data ------------------------------------------------------------------------------

    def _scene_data(self, slot: str) -> Nodes:
        owner, _, name = slot.partition(".")
        if name == "w":  # a motion starts with w
            return self._all_nodes(f"{owner}.motion")[:3]
        owner = "body" if owner in ROLES else owner
        read: Callable[[str], Nodes] = getattr(self, f"_{owner}")
        return read(name)

    def _body(self, name: str) -> Nodes:
        f, body = self.state, self.body
        q, u = slice(body.q, body.q + body.nq), slice(body.u, body.u + body.nu)
        if name == "q":
            return f.q[q]
        if name in ("u", "efforts", "column", "given"):
            return {"u": f.u, "given": f.given_accelerations}.get(name, f.efforts)[u]
        if name in ("bias_offset", "answer", "required"):
            return f.zeros(body.nu)
        return f.entries({"p": body.body_p, "rotor": body.rotor}[name])

    def _hinge(self, name: str) -> Nodes:
        if name == "p":
            return self.state.entries(self.body.hinge_p)
        return []  # without speeds H has no columns and nothing is eliminated

    def _connection(self, name: str) -> Nodes:
        f, body = self.state, self.body
        if not body.link:
            return f.entries(body.rotation if name == "R" else body.position)
        cosine, sine, shift, _, _ = f.entries(body.link)
        if name == "r":
            return [shift, f.zero, f.zero]
        rotation = f.identity()
        rotation[4], rotation[5], rotation[7], rotation[8] = cosine, -sine, sine, cosine
        return rotation

    def _link(self, name: str) -> Nodes:
        """Constant part of the hinge's own screw."""
        f, body = self.state, self.body
        angle, shift = f.entries(body.link[3:])
        if name == "lift":
            return [f.zero, f.zero, shift]
        place = rotation_coordinate(body.hinge)
        return [x + angle if k == place else x for k, x in enumerate(self._all_nodes("body.q"))]

    def _modes(self, name: str) -> Nodes:
        f, modal = self.state, self.modal
        if name in ("K", "D"):
            return f.entries(modal.stiffness if name == "K" else modal.damping)
        if name == "eta":
            return f.q[modal.q : modal.q + modal.n]
        source = {"etad": f.u, "given": f.given_accelerations}.get(name, f.efforts)
        return source[modal.u : modal.u + modal.n]

    def _moments(self, name: str) -> Nodes:
        return self._field(self.modal.moments, name)

    def _drag(self, name: str) -> Nodes:
        return self._field(self.modal.drag, name)

    def _section(self, name: str) -> Nodes:
        section = self.body.section
        assert section is not None
        if name == "end":
            return self.state.entries(section.end)
        return self._field(section.numbers, name)

    def _field(self, numbers: tuple[tuple[str, Entries], ...], name: str) -> Nodes:
        return self.state.entries(dict(numbers)[name])

    def _law(self, name: str) -> Nodes:
        f, law, body = self.state, self.subject.law, self.body
        assert law is not None
        if name == "turn":
            return [f.memory[law.twist]]
        if name in ("p", "axes"):
            return f.entries(law.p if name == "p" else law.axes)
        q, u = body.q + law.coordinate, body.u + law.speed
        if name == "u":
            return f.u[u : u + law.n]
        return f.q[q : q + (law.n if not law.axes else law.n + 1)]

    def _load(self, name: str) -> Nodes:
        assert self.subject.load is not None
        return self.state.entries(getattr(self.subject.load, name))

    def _force(self, name: str) -> Nodes:
        assert self.subject.force is not None
        return self.state.entries(getattr(self.subject.force, name.lower()))

    def _speed(self, name: str) -> Nodes:
        return [(self.state.u if name == "u" else self.state.efforts)[self.subject.index]]

    def _scene(self, name: str) -> Nodes:
        assert name == "t"
        return [self.state.t]
