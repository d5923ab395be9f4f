"""Slots of the schedule as nodes of one graph: what the scene gives, and what calls have filled."""

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

#: The ground, a body without a number.
GROUND = -1


@dataclass(frozen=True)
class Subject:
    """What a pass is at: a body (by its roles), and the law, load, force, drive or row if it is
    one; of rows those met with it, and the direction of its hinge whose row it is."""

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
    """Nodes by slot.  `local` slots end with the subject."""

    def __init__(self, state: FusionState) -> None:
        self.state = state
        self._filled: dict[Hashable, Nodes] = {}
        self.local: dict[str, Nodes] = {}
        self.at = Subject({})
        gravity = [-g for g in state.entries(state.structure.gravity)]
        still = {"A": state.identity(), "motion": [*state.zeros(6), *gravity]}
        sizes = {"x": 3, "v": 3, "delta": 6, "e": 6, "S": 21}
        still |= {name: state.zeros(size) for name, size in sizes.items()}
        self._filled |= {(GROUND, f"body.{name}"): nodes for name, nodes in still.items()}
        self._filled[0, "sums.power"] = self._filled[0, "sums.potential"] = [state.zero]

    # --- the subject ----------------------------------------------------------------------------

    def enter(self, subject: Subject) -> None:
        """What slots are meant of from now on."""
        self.at, self.local = subject, {}

    @property
    def index(self) -> int:
        """Place of the body at hand."""
        return self.at.roles["body"]

    @property
    def body(self) -> BodyStructure:
        """The body at hand."""
        return self.state.structure.bodies[self.index]

    @property
    def frame(self) -> int:
        """Place of the flexible body that the body at hand belongs to."""
        section = self.body.section
        return self.index if section is None else section.frame

    @property
    def modal(self) -> ModalStructure:
        """The modes that the body at hand belongs to."""
        found = self.state.structure.bodies[self.frame].modal
        assert found is not None
        return found

    # --- reading and filling --------------------------------------------------------------------

    def get(self, slot: str, length: int) -> Nodes:
        """Nodes of a slot; `length` says how many numbers a constant has."""
        if slot == "identity":
            return self.state.identity()
        if slot in ("zero", "none"):
            return self.state.zeros(length)
        name, _, picked = slot.partition("[")
        found = self._whole(name)
        if picked:
            found = [found[int(place)] for place in picked.rstrip("]").split()]
        return found

    def _whole(self, slot: str) -> Nodes:
        if slot.startswith("local."):
            return self.local[slot]
        key = self._key(slot)
        if key not in self._filled:
            self._filled[key] = self._given(slot)
        return self._filled[key]

    def fill(self, slot: str, nodes: Nodes) -> None:
        """Put nodes into a slot, or into the entries that are named."""
        name, _, picked = slot.partition("[")
        if picked:
            whole = list(self._whole(name))
            for place, node in zip(picked.rstrip("]").split(), nodes, strict=True):
                whole[int(place)] = node
            nodes = whole
        if name.startswith("local."):
            self.local[name] = nodes
        elif name in ("drive.q", "drive.u", "drive.s"):
            self._prescribe(name, nodes[0])
        else:
            self._filled[self._key(name)] = nodes

    def _prescribe(self, slot: str, node: Node) -> None:
        """A driven coordinate, its speed or its acceleration, where everybody reads it."""
        f, speed = self.state, self.state.structure.driven[self.at.index][1]
        if slot == "drive.s":
            self.fill(f"body.s[{speed}]", [node])
        elif slot == "drive.q":
            f.q[self.body.q + speed] = node
        else:
            f.u[self.body.u + speed] = node

    def filled(self, index: int, slot: str) -> Nodes | None:
        """What a slot of a body holds; None if nothing was put there."""
        return self._filled.get((index, slot))

    def gathered(self, name: str) -> Nodes:
        """What every body and its modes have in the slot `name`, in the order of the state."""
        s = self.state.structure
        found = self.state.zeros(s.nq if name == "qdot" else s.nu)
        for index, body in enumerate(s.bodies):
            first = body.q if name == "qdot" else body.u
            own = self.filled(index, f"body.{name}") or []
            found[first : first + len(own)] = own
            if body.modal is not None:
                first = body.modal.q if name == "qdot" else body.modal.u
                found[first : first + body.modal.n] = self.filled(index, f"modes.{name}") or []
        return found

    def _key(self, slot: str) -> Hashable:
        owner, _, name = slot.partition(".")
        if owner in ROLES:
            return self.at.roles[owner], f"body.{name}"
        if owner in ("modes", "moments", "drag"):
            return self.frame, slot
        if owner in ("sums", "scene"):
            return 0, slot
        if owner in ("law", "load", "force", "drive", "speed"):
            return self.at.index, slot
        return self.index, slot

    # --- what the scene gives -------------------------------------------------------------------

    def _given(self, slot: str) -> Nodes:
        owner, _, name = slot.partition(".")
        if name == "w":  # the first of a motion
            return self._whole(f"{owner}.motion")[:3]
        owner = "body" if owner in ROLES else owner
        read: Callable[[str], Nodes] = getattr(self, f"_{owner}")
        return read(name)

    def _body(self, name: str) -> Nodes:
        f, body = self.state, self.body
        q, u = slice(body.q, body.q + body.nq), slice(body.u, body.u + body.nu)
        if name == "q":
            return f.q[q]
        if name in ("u", "efforts", "column", "given"):
            return {"u": f.u, "given": f.given}.get(name, f.efforts)[u]
        if name in ("chosen", "answer", "required"):
            return f.zeros(body.nu)
        return f.entries({"p": body.body_p, "rotor": body.rotor}[name])

    def _hinge(self, name: str) -> Nodes:
        if name == "p":
            return self.state.entries(self.body.hinge_p)
        return []  # no speeds: no columns of H, nothing eliminated

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
        """The constant part of the hinge's own screw."""
        f, body = self.state, self.body
        angle, shift = f.entries(body.link[3:])
        if name == "lift":
            return [f.zero, f.zero, shift]
        place = rotation_coordinate(body.hinge)
        return [x + angle if k == place else x for k, x in enumerate(self._whole("body.q"))]

    def _modes(self, name: str) -> Nodes:
        f, modal = self.state, self.modal
        if name in ("K", "D"):
            return f.entries(modal.stiffness if name == "K" else modal.damping)
        if name == "eta":
            return f.q[modal.q : modal.q + modal.n]
        source = {"etad": f.u, "given": f.given}.get(name, f.efforts)
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
        f, law, body = self.state, self.at.law, self.body
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
        assert self.at.load is not None
        return self.state.entries(getattr(self.at.load, name))

    def _force(self, name: str) -> Nodes:
        assert self.at.force is not None
        return self.state.entries(getattr(self.at.force, name.lower()))

    def _speed(self, name: str) -> Nodes:
        return [(self.state.u if name == "u" else self.state.efforts)[self.at.index]]

    def _scene(self, name: str) -> Nodes:
        assert name == "t"
        return [self.state.t]
