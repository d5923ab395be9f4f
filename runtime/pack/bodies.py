"""Bodies of a scene -> C records: one filled per body table, copied to all members of a chain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mstmm.errors import SceneError
from mstmm.ir.facts import builtin_hinges
from mstmm.ir.param import Param
from mstmm.ir.tape import Tape
from mstmm.numbers.rotations import Matrix
from mstmm.scene import Body, Hinge, Scene
from mstmm.scene.checks.topology import Run, Topology
from mstmm.scene.tables.hinge_frames import hinge_frames, key_numbers

from ..flexible.records import ModalRecords, in_frame, section_in
from ..kernels import prebuilt
from ..kernels.prebuilt import Element
from ..kernels.records import Lookup, Records
from . import alignment, placement
from .alignment import connection_of
from .flexible.expansion import Expanded
from .layout import Group, HingeSlots, Layout
from .placement import GROUND, Placement, rigid_parameters

Known = Mapping[tuple[str, str], Element]
Texts = tuple[str, ...]
Numbers = tuple[float, ...]


#: The type that a weld runs as which lets go later: it is held until then.
LETS_GO = "free"


def kernel_type(hinge: Hinge, releases: Mapping[str, int]) -> str:
    """Name of the element whose kernels move a hinge."""
    if hinge.is_weld and hinge.name in releases:
        return LETS_GO
    return hinge.type if hinge.facts is None else hinge.facts.runs_as


class Elements:
    """Prebuilt elements and those of the user's, by kind and name."""

    def __init__(self, known: Known) -> None:
        self.known = known

    def get(self, kind: str, name: str, user: str) -> Element:
        """The element that `user` names as its type; SceneError if nobody defines it."""
        found = self.known.get((kind, name)) or prebuilt.elements().get((kind, name))
        if found is None:
            raise SceneError(
                f'scene: {kind} "{user}": type: nothing is known of the type "{name}"; '
                f"generate it with: mstmm generate FILE, or mstmm list shows what there is"
            )
        return found


def layout_of(expanded: Expanded, releases: Mapping[str, int], elements: Elements) -> Layout:
    """Places of all hinges in q and u: the scene's hinges, those of its chains, then the modes."""
    scene = expanded.scene
    groups: list[Group] = []
    q = u = 0
    starts = [*range(len(scene.hinge)), *scene.hinges.starts[:-1]]
    counts = [1] * len(scene.hinge) + [chain.count for chain in scene.chain]
    patterns = [1] * len(scene.hinge) + [len(chain.hinge) for chain in scene.chain]
    for first, count, pattern in zip(starts, counts, patterns, strict=True):
        slots, nq, nu = [], 0, 0
        for hinge in scene.hinges[first : first + pattern]:
            slots.append(_slots(hinge, releases, elements, q + nq, u + nu))
            nq, nu = nq + slots[-1].nq, nu + slots[-1].nu
        groups.append(Group(first, count, tuple(slots), nq, nu))
        repeats, rest = divmod(count, pattern)
        q += repeats * nq + sum(s.nq for s in slots[:rest])
        u += repeats * nu + sum(s.nu for s in slots[:rest])
    modal = {}
    for name, body in expanded.bodies.items():
        n = len(body.modes)
        units = tuple("rad" if mode.startswith("twist") else "m" for mode in body.modes)
        rates = tuple(f"{unit}/s" for unit in units)
        speeds = tuple(f"{mode}_rate" for mode in body.modes)
        modal[name] = HingeSlots(name, "modes", q, u, body.modes, units, speeds, rates, None, True)
        q, u = q + n, u + n
    internal = range(len(expanded.described.hinge), len(scene.hinge))
    return Layout(scene, tuple(groups), q, u, modal, internal)


def _slots(
    hinge: Hinge, releases: Mapping[str, int], elements: Elements, q: int, u: int
) -> HingeSlots:
    running = kernel_type(hinge, releases)
    elements.get("hinge", running, hinge.name)
    facts = builtin_hinges()[LETS_GO] if hinge.is_weld and running == LETS_GO else hinge.facts
    assert facts is not None  # or the element would not be known
    return HingeSlots(
        hinge.name, hinge.type, q, u, *_texts(facts.coordinates), *_texts(facts.speeds),
        facts.quaternion, facts.straight,
    )  # fmt: skip


def _texts(entries: Sequence[Param]) -> tuple[Texts, Texts]:
    """Names and units."""
    return tuple(entry.name for entry in entries), tuple(entry.unit for entry in entries)


class BodyRecords:
    """Fills the engine's records of bodies.

    A body of its own is filled in its place.  Of a chain the first member and one period of its
    pattern are filled as prototypes and copied: they share the arrays that the records point to.
    """

    def __init__(
        self,
        scene: Scene,
        topology: Topology,
        layout: Layout,
        elements: Elements,
        releases: Mapping[str, int],
        ffi: Any,
        lib: Any,
        kept: list[Any],
        c_tape: Callable[[Tape], Any],
        align: bool,
        expanded: Expanded,
    ) -> None:
        self.expanded = expanded
        self.modal = ModalRecords(ffi, lib, kept)
        #: C records of the flexible bodies by their names.
        self._modal: dict[str, Any] = {}
        self.scene, self.topology, self.layout, self.elements = scene, topology, layout, elements
        self.releases, self.ffi, self.lib, self.kept = releases, ffi, lib, kept
        self.c_tape, self.align = c_tape, align
        #: First body of a run -> placements of one period.
        self._placements: dict[int, list[Placement]] = {}
        #: First body of a chain -> placement of its last member.
        self._last: dict[int, Placement] = {}

    @property
    def placements(self) -> Mapping[str, Placement]:
        """Internal frame of every body."""
        return Lookup(self.scene.bodies, self.placement)

    def placement(self, body: int) -> Placement:
        """Internal frame of the body of this number."""
        if body < len(self.scene.body):
            return self._placements[body][0]
        chain, k = self.scene.bodies.member(body)
        first = self.scene.bodies.starts[chain]
        if k + 1 == self.scene.chain[chain].count:
            return self._last[first]
        period = self._placements[first]
        return period[k % len(period)]

    def fill(self) -> tuple[Records, int]:
        """(records in the order of the topology, length of their blocks in the workspace)."""
        records = Records(self.ffi, "mstmm_body", self.topology.count)
        self.kept.append(records)
        for run in self.topology.runs:
            if run.count == 1 and run.body < len(self.scene.body):
                self._body(records.array[run.place], run, 0)
            else:
                self._chain(records, run)
        self._columns(records)
        return records, self._blocks(records)

    def _chain(self, records: Records, run: Run) -> None:
        """Prototypes 0: the first member; then members 1 to period + 1, which repeat; the last one,
        whose frame suits what hangs on it."""
        period = self._period(run)
        count = min(run.count, period + 1)
        more = run.count > count
        prototypes = Records(self.ffi, "mstmm_body", count + more)
        for k in range(count):
            self._body(prototypes.array[k], run, k)
        which = np.arange(run.count)
        which[1:] = 1 + (which[1:] - 1) % period
        if more:
            self._body(prototypes.array[count], run, run.count - 1)
            which[-1] = count
        self._last[run.body] = self._placements[run.body][-1]
        records.copy(slice(run.place, run.place + run.count), prototypes, which)
        del self._placements[run.body][period:]

    def _columns(self, records: Records) -> None:
        """What differs from member to member."""
        parents = np.arange(-1, records.count - 1)
        hinges = np.arange(records.count)
        for run in self.topology.runs:
            parents[run.place] = run.parent
            hinges[run.place : run.place + run.count] = np.arange(run.hinge, run.hinge + run.count)
        records.write("parent", parents)
        records.write("q", self.layout.q_places[hinges])
        records.write("u", self.layout.u_places[hinges])

    def _blocks(self, records: Records) -> int:
        """Places of the blocks in the workspace, behind the ground's."""
        fixed, per_speed = self.lib.MSTMM_BLOCK_FIXED, self.lib.MSTMM_BLOCK_PER_SPEED
        lengths = fixed + per_speed * records.column("nu").astype(np.int64)
        ends = fixed + np.cumsum(lengths)
        records.write("block", ends - lengths)
        return int(ends[-1]) if len(ends) else int(fixed)

    # --- one record -------------------------------------------------------------------------

    def _body(self, record: Any, run: Run, k: int) -> None:
        """Everything of the run's member k but its places."""
        body, hinge = self.scene.bodies[run.body + k], self.scene.hinges[run.hinge + k]
        slots = self.layout.slots(run.hinge + k)
        kernel = self.elements.get("hinge", kernel_type(hinge, self.releases), hinge.name)
        inboard, outboard = hinge_frames(hinge)
        own = placement.place(body, run.outboard_end, outboard)
        flexible = self.expanded.is_node(body.name)
        child = self._child(run, k) if self.align and not flexible else None
        place = alignment.aligned(own, body, hinge, child)
        self._placements.setdefault(run.body, []).append(place)
        record.nq, record.nu = slots.nq, slots.nu
        record.hinge_p = self.reals(self._hinge_parameters(hinge))
        self._hinge_functions(record, kernel)
        rigid = self._body_functions(record, body, place)
        self._imposed(record, hinge, slots)
        self._connection(record, run, k, inboard, place, rigid, flexible)
        if flexible:
            self._flexible(record, body.name, place)

    def _flexible(self, record: Any, name: str, place: Placement) -> None:
        """Modes and sections of a node of a flexible body."""
        passage = self.expanded.passages.get(name)
        body = self.expanded.bodies.get(passage.body if passage else name)
        if body is None:
            return  # the massless node of the section that is held
        if name in self.expanded.bodies:
            turned = in_frame(body, np.array(place.rotation), np.array(place.origin))
            slots = self.layout.modal[name]
            record.modal = self._modal[name] = self.modal.modal(turned, slots.q, slots.u)
        if passage is None:
            return
        port = passage.port
        if not passage.inward:
            frame = self.placement_of(passage.body)
            port = section_in(port, np.array(frame.rotation), np.array(frame.origin))
        record.section = self.modal.section(port, self._modal[passage.body], passage.inward)
        record.idle = int(name in self.expanded.idle)
        record.generic = 1
        if not passage.inward:
            record.connection = self.reals((1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0, 0, 0, 0))

    def placement_of(self, body: str) -> Placement:
        """Internal frame of the body of this name."""
        number = self.scene.bodies.find(body)
        assert number is not None
        return self.placement(number)

    def _connection(
        self,
        record: Any,
        run: Run,
        k: int,
        inboard: Matrix,
        own: Placement,
        rigid: Numbers,
        flexible: bool,
    ) -> None:
        """Way from the parent's frame; as a link where it is one.  `rigid`: the body's numbers."""
        hinge = self.scene.hinges[run.hinge + k]
        parent, parent_place = self._parent(run, k)
        turned, point = placement.connection(parent_place, parent, hinge, inboard, own)
        numbers = (*turned[0], *turned[1], *turned[2], *point)
        axial = self.align and not flexible and alignment.is_axial(hinge)
        link = alignment.link_of(turned, point) if axial else None
        record.held[2] = -own.height
        record.connection = self.reals(numbers if link is None else connection_of(link))
        if link is None:
            return
        kernel = prebuilt.elements()["sweep", f"link_{kernel_type(hinge, self.releases)}"]
        lead = tuple(key_numbers(hinge).values()) or (0.0,)  # every link has room for it
        record.link = self.reals((*link, *rigid, *lead))
        if rigid and not record.generic:
            for name, function in kernel.functions.items():
                setattr(record, f"link_{name}", function)

    def _child(self, run: Run, k: int) -> tuple[Hinge, str] | None:
        """First hinge on a body, and the body's end that it hangs on."""
        if k + 1 < run.count:
            return self.scene.hinges[run.hinge + k + 1], run.ends[k % len(run.ends)]
        found = self._first_children.get(run.place + k)
        return None if found is None else (self.scene.hinges[found.hinge], found.inboard_end)

    def _period(self, run: Run) -> int:
        return self.scene.chain[self.scene.bodies.member(run.body)[0]].period

    @cached_property
    def _first_children(self) -> dict[int, Run]:
        """Place of a body -> the first run that hangs on it."""
        found: dict[int, Run] = {}
        for run in self.topology.runs:
            found.setdefault(run.parent, run)
        return found

    def _parent(self, run: Run, k: int) -> tuple[Body | None, Placement]:
        if k:
            before = self._placements[run.body][(k - 1) % self._period(run)]
            return self.scene.bodies[run.body + k - 1], before
        if run.parent < 0:
            return None, GROUND
        number = self.topology.at(run.parent)[0]
        return self.scene.bodies[number], self.placement(number)

    def reals(self, numbers: tuple[float, ...]) -> Any:
        array = self.ffi.new("real[]", list(numbers) or [0.0])
        self.kept.append(array)
        return array

    def _hinge_parameters(self, hinge: Hinge) -> tuple[float, ...]:
        """Numbers of the hinge's kernel: of keys of the scene, and given by name."""
        if hinge.facts is None:
            return ()
        own = hinge.facts.own_parameters()
        given = declared_numbers(own, hinge.parameters, f'hinge "{hinge.name}"')
        known = {**dict(zip((p.name for p in own), given, strict=True)), **key_numbers(hinge)}
        return tuple(known[p.name] for p in hinge.facts.parameters)

    def _hinge_functions(self, record: Any, kernel: Element) -> None:
        for name in ("hinge", "forward", "condense", "recover"):
            setattr(record, name, kernel.functions.get(name, self.ffi.NULL))
        if kernel.tape is not None:
            record.tape = self.c_tape(kernel.tape)
        record.generic = int(record.condense == self.ffi.NULL)

    def _body_functions(self, record: Any, body: Body, place: Placement) -> Numbers:
        """Kernels and numbers of the body; returns the numbers of a rigid one, else none."""
        element = self.elements.get("body", body.type, body.name)
        for name in ("inertia", "bias_load", "energy"):
            setattr(record, name, element.functions[name])
        if body.type == "rigid":
            rigid = rigid_parameters(body, place)
            record.body_p = self.reals(rigid)
            return rigid
        record.body_p = self.reals(self._user_body(body, element, place))
        return ()

    def _user_body(self, body: Body, element: Element, place: Placement) -> tuple[float, ...]:
        """Parameters, then the internal frame in the body's own: rotation (9) and origin (3)."""
        numbers = user_parameters(element, body.parameters, f'body "{body.name}"')
        turn = place.rotation
        return (*numbers, *turn[0], *turn[1], *turn[2], *place.origin)

    def _imposed(self, record: Any, hinge: Hinge, slots: HingeSlots) -> None:
        held = hinge.is_weld and slots.nu > 0
        if held:
            mask, rotor = [1] * slots.nu, [0.0] * slots.nu
        else:
            mask = [int(entry is not None) for entry in hinge.drive or (None,) * slots.nu]
            rotor = [hinge.law.entry(k).inertia for k in range(slots.nu)]
        record.release = self.releases.get(hinge.name, -1)
        record.n_imposed = sum(mask)
        record.imposed_mask = self._ints(mask)
        record.rotor = self.reals(tuple(rotor))
        if sum(mask) or any(rotor):
            record.generic = 1

    def _ints(self, numbers: list[int]) -> Any:
        array = self.ffi.new("int[]", numbers or [0])
        self.kept.append(array)
        return array


def user_parameters(element: Element, given: Mapping[str, float], where: str) -> tuple[float, ...]:
    """Numbers of a user's element in its order, defaults filled in; errors as below."""
    return declared_numbers(element.declared, given, where)


def declared_numbers(
    declared: Sequence[Param], given: Mapping[str, float], where: str
) -> tuple[float, ...]:
    """Numbers of declared parameters in their order, defaults filled in.

    Raises SceneError naming the scene's element (`where`) for what is missing or out of bounds.
    """
    numbers = []
    for p in declared:
        value = given.get(p.name, p.default)
        problem = ""
        if value is None:
            problem = "missing; expected a number"
        elif p.minimum is not None and value < p.minimum:
            problem = f"expected {p.minimum:g} {p.unit} or more, found {value:g}"
        elif p.maximum is not None and value > p.maximum:
            problem = f"expected {p.maximum:g} {p.unit} or less, found {value:g}"
        if value is None or problem:
            raise SceneError(f"scene: {where}: parameters.{p.name}: {problem}")
        numbers.append(value)
    return tuple(numbers)
