"""Scene -> arrays of the looped engine: one C record per body, law, load and force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mstmm.errors import SceneError
from mstmm.expression import Expression
from mstmm.hinge_types import HINGE_TYPES
from mstmm.ir import KernelIR
from mstmm.scene import Hinge, Scene, split
from mstmm.tape import Tape, compile_tape
from mstmm.topology import GROUND_INDEX, Topology, build

from . import placement, prebuilt, values
from .laws import pack_laws
from .layout import HingeSlots, Layout
from .placement import GROUND, KERNEL_OF, Placement
from .prebuilt import Element
from .product import attach

Known = Mapping[tuple[str, str], Element]


@dataclass
class Packed:
    """A scene in the engine's arrays.  `kept` holds what C points to."""

    scene: Scene
    topology: Topology
    layout: Layout
    ffi: Any
    lib: Any
    model: Any
    placements: dict[str, Placement]
    positions: dict[str, int]
    hinge_position: dict[str, int]
    releases: dict[str, int]
    n_memory: int
    breaks: tuple[float, ...]
    warnings: list[str] = field(default_factory=list)
    #: kernels of the scene's expressions: "values", "drives", and "effort k" of spring k
    expressions: dict[str, KernelIR] = field(default_factory=dict)
    kept: list[Any] = field(default_factory=list)

    def end(self, reference: str) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
        """(body position, axes (9), offset (3)) of "body" or "body.end", internal axes."""
        name, at = split(reference)
        if name == "ground":
            return GROUND_INDEX, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0.0, 0.0, 0.0)
        place = self.placements[name]
        body = self.scene.body[self.topology.links[self.positions[name]].body]
        axes = place.axes(body.end_rotation(at))
        return (
            self.positions[name],
            (*axes[0], *axes[1], *axes[2]),
            place.point(body.end_position(at)),
        )


def releasable(scene: Scene) -> list[str]:
    """Hinges that let go during the run, by their own `release` or by an event."""
    names = [h.name for h in scene.hinge if h.release is not None]
    for event in scene.event:
        if event.do == "release" and event.hinge not in names:
            names.append(str(event.hinge))
    return names


def kernel_type(hinge: Hinge, releases: Mapping[str, int]) -> str:
    """Type of the hinge's kernel; a weld that lets go is a held free hinge from the start."""
    if hinge.type == "fixed" and hinge.name in releases:
        return "free"
    return KERNEL_OF.get(hinge.type, hinge.type)


def pack(scene: Scene, known: Known | None = None, product_accuracy: float | None = None) -> Packed:
    """Engine arrays of a scene; `known` are elements beyond the prebuilt ones.

    With `product_accuracy` accelerations come from the plain product of classical matrices, which
    may deviate from the Riccati sweep by that much.

    Raises SceneError for hinges that do not form a tree or types that nobody defines.
    """
    packed = _Packing(scene, known or {}).run()
    if product_accuracy is not None:
        attach(packed, product_accuracy)
        resize(packed, int(packed.model.tape_slots))
    return packed


class _Packing:
    """One pass over a scene; every method fills one part of the model."""

    def __init__(self, scene: Scene, known: Known) -> None:
        self.scene, self.known = scene, known
        self.ffi, self.lib = prebuilt.module()
        self.kept: list[Any] = []
        self.topology = build(scene)
        self.releases = {name: i for i, name in enumerate(releasable(scene))}
        self.kernels = [
            self.element("hinge", kernel_type(h, self.releases), h.name) for h in scene.hinge
        ]
        self.layout = self._layout()
        self.values = values.Values(self.layout)
        self.placements: dict[str, Placement] = {}
        self.slots = 0

    def element(self, kind: str, name: str, user: str) -> Element:
        """Prebuilt or known element; SceneError if nobody defines it."""
        found = self.known.get((kind, name)) or prebuilt.elements().get((kind, name))
        if found is None:
            raise SceneError(
                f'scene: {kind} "{user}": type: nothing is known of the type "{name}"; '
                f"generate it with: mstmm generate FILE, or mstmm list shows what there is"
            )
        return found

    def run(self) -> Packed:
        model = self.ffi.new("mstmm_model *")
        positions = {self.scene.body[b].name: i for i, b in enumerate(self.topology.order)}
        packed = Packed(
            self.scene, self.topology, self.layout, self.ffi, self.lib, model, self.placements,
            positions,
            {self.scene.hinge[link.hinge].name: i for i, link in enumerate(self.topology.links)},
            self.releases, 0, (), kept=self.kept,
        )  # fmt: skip
        self.kept.append(model)
        self._bodies(packed)
        self._drives(packed)
        packed.n_memory = len(self.releases) + pack_laws(packed, self.values)
        self._loads(packed)
        self._forces(packed)
        self._tapes(packed)
        self._sizes(packed)
        packed.breaks = tuple(sorted(self._breaks()))
        return packed

    # --- layout -----------------------------------------------------------------------------

    def _layout(self) -> Layout:
        hinges: dict[str, HingeSlots] = {}
        q = u = 0
        for hinge, kernel in zip(self.scene.hinge, self.kernels, strict=True):
            held = hinge.type == "fixed" and kernel.nu
            kind = HINGE_TYPES.get("free" if held else hinge.type)
            descriptor = kernel.descriptor
            names = _names(self.ffi, descriptor)
            slots = HingeSlots(
                hinge.name, hinge.type, q, u, *names, kind.quaternion if kind else None
            )
            hinges[hinge.name] = slots
            q, u = q + slots.nq, u + slots.nu
        return Layout(hinges, q, u)

    # --- bodies -----------------------------------------------------------------------------

    def _bodies(self, packed: Packed) -> None:
        records = self.ffi.new("mstmm_body[]", max(1, len(self.scene.body)))
        self.kept.append(records)
        block = int(self.lib.MSTMM_BLOCK_FIXED)
        for i, link in enumerate(self.topology.links):
            body, hinge = self.scene.body[link.body], self.scene.hinge[link.hinge]
            kernel = self.kernels[link.hinge]
            inboard, outboard, numbers = placement.alignment(hinge)
            place = placement.place(body, link.outboard_end, outboard)
            self.placements[body.name] = place
            parent = None if link.parent < 0 else self.scene.body[self.topology.order[link.parent]]
            parent_place = GROUND if parent is None else self.placements[parent.name]
            record, slots = records[i], self.layout.hinges[hinge.name]
            record.parent, record.block = link.parent, block
            record.q, record.u, record.nq, record.nu = slots.q, slots.u, slots.nq, slots.nu
            connection = placement.connection(parent_place, parent, hinge, inboard)
            record.connection = self.reals(connection)
            record.hinge_p = self.reals(self._hinge_parameters(hinge, kernel, numbers))
            self._hinge_functions(record, kernel)
            self._body_functions(record, body, place)
            self._imposed(record, hinge, slots)
            block += self.lib.MSTMM_BLOCK_FIXED + self.lib.MSTMM_BLOCK_PER_SPEED * slots.nu
        packed.model.bodies, packed.model.n_bodies = records, len(self.scene.body)
        packed.model.scratch = block
        for k in range(3):
            packed.model.gravity[k] = self.scene.gravity[k]

    def reals(self, numbers: tuple[float, ...]) -> Any:
        array = self.ffi.new("real[]", list(numbers) or [0.0])
        self.kept.append(array)
        return array

    def _hinge_parameters(
        self, hinge: Hinge, kernel: Element, builtin: tuple[float, ...]
    ) -> tuple[float, ...]:
        if hinge.type in HINGE_TYPES:
            return builtin
        return user_parameters(kernel, hinge.parameters, f'hinge "{hinge.name}"')

    def _hinge_functions(self, record: Any, kernel: Element) -> None:
        for name in ("hinge", "forward", "condense", "recover"):
            setattr(record, name, kernel.functions.get(name, self.ffi.NULL))
        if kernel.tape is not None:
            record.tape = self._c_tape(kernel.tape)
        record.generic = int(record.condense == self.ffi.NULL)

    def _body_functions(self, record: Any, body: Any, place: Placement) -> None:
        element = self.element("body", body.type, body.name)
        for name in ("inertia", "bias_load", "energy"):
            setattr(record, name, element.functions[name])
        if body.type == "rigid":
            record.body_p = self.reals(placement.rigid_parameters(body, place))
        else:
            record.body_p = self.reals(self._user_body(body, element, place))

    def _user_body(self, body: Any, element: Element, place: Placement) -> tuple[float, ...]:
        """Parameters, then the internal frame in the body's own: rotation (9) and origin (3)."""
        numbers = user_parameters(element, body.parameters, f'body "{body.name}"')
        turn = place.rotation
        return (*numbers, *turn[0], *turn[1], *turn[2], *place.origin)

    def _imposed(self, record: Any, hinge: Hinge, slots: HingeSlots) -> None:
        held = hinge.type == "fixed" and slots.nu > 0
        if held:
            mask, rotor = [1] * slots.nu, [0.0] * slots.nu
        else:
            mask = [int(entry is not None) for entry in hinge.drive or (None,) * slots.nu]
            rotor = [hinge.law.entry(k).inertia for k in range(slots.nu)]
        record.release = self.releases.get(hinge.name, -1)
        record.n_imposed = sum(mask)
        record.imposed_mask = self.ints(mask)
        record.rotor = self.reals(tuple(rotor))
        if sum(mask) or any(rotor):
            record.generic = 1

    def ints(self, numbers: list[int]) -> Any:
        array = self.ffi.new("int[]", numbers or [0])
        self.kept.append(array)
        return array

    # --- drives, loads, forces ------------------------------------------------------------------

    def _drives(self, packed: Packed) -> None:
        driven: list[tuple[int, int, Expression]] = []
        for i, link in enumerate(self.topology.links):
            for k, entry in enumerate(self.scene.hinge[link.hinge].drive or ()):
                if entry is not None:
                    driven.append((i, k, entry))
        records = self.ffi.new("mstmm_drive[]", max(1, len(driven)))
        for record, (body, k, _) in zip(records, driven, strict=False):
            record.body, record.coordinate, record.speed = body, k, k
        packed.model.drives, packed.model.n_drives = records, len(driven)
        self.kept.append(records)
        self._driven = [entry for _, _, entry in driven]
        if driven:
            packed.model.drive_tape = self._expression(
                packed, "drives", values.drive_kernel(self._driven)
            )

    def _expression(self, packed: Packed, name: str, kernel: KernelIR) -> Any:
        packed.expressions[name] = kernel
        return self._c_tape(compile_tape(kernel))

    def _c_tape(self, tape: Tape) -> Any:
        self.slots = max(self.slots, tape.slots)
        return values.c_tape(self.ffi, tape, self.kept)

    def _loads(self, packed: Packed) -> None:
        records = self.ffi.new("mstmm_load[]", max(1, len(self.scene.load)))
        self.kept.append(records)
        for record, load in zip(records, self.scene.load, strict=False):
            record.body, _, offset = packed.end(load.on)
            record.offset = list(offset)
            record.force = [self.values.place(e) for e in load.force]
            record.moment = [self.values.place(e) for e in load.moment]
            name = split(load.on)[0] if load.axes == "body" else load.axes
            reference = "ground" if load.axes == "inertial" else name
            record.axes, own, _ = packed.end(reference)
            record.axes_own = list(own)
        packed.model.loads, packed.model.n_loads = records, len(self.scene.load)

    def _forces(self, packed: Packed) -> None:
        records = self.ffi.new("mstmm_force[]", max(1, len(self.scene.spring)))
        self.kept.append(records)
        for index, (record, spring) in enumerate(zip(records, self.scene.spring, strict=False)):
            element = self.element("force", spring.type, spring.name)
            for letter, reference in (("f", spring.from_), ("t", spring.to)):
                body, axes, offset = packed.end(reference)
                if body < 0:
                    offset = spring.position
                setattr(record, f"body_{letter}", body)
                setattr(record, f"axes_{letter}", list(axes))
                setattr(record, f"offset_{letter}", list(offset))
            record.wrench = element.functions["wrench"]
            if spring.type == "spring":
                law = spring.law
                record.p = self.reals((law.stiffness, law.rest, law.damping))
                if not law.effort.is_zero:
                    record.effort = self._expression(
                        packed, f"effort {index}", values.effort_kernel(law.effort, self.layout)
                    )
                    self.values.breaks.update(law.effort.time_breaks())
            else:
                given = user_parameters(element, spring.parameters, f'spring "{spring.name}"')
                record.p = self.reals(given)
        packed.model.forces, packed.model.n_forces = records, len(self.scene.spring)
        packed.model.needs_pose = int(bool(self.scene.spring or self.scene.load))

    # --- sizes ------------------------------------------------------------------------------

    def _tapes(self, packed: Packed) -> None:
        packed.model.n_values = len(self.values)
        if len(self.values):
            packed.model.value_tape = self._expression(packed, "values", self.values.kernel())

    def _sizes(self, packed: Packed) -> None:
        model, layout = packed.model, self.layout
        model.nq, model.nu, model.n_memory = layout.nq, layout.nu, packed.n_memory
        resize(packed, self.slots)  # tapes of events are laid out later and may need more

    def _breaks(self) -> set[float]:
        breaks = set(self.values.breaks)
        for entry in self._driven:
            breaks.update(entry.time_breaks())
        for hinge in self.scene.hinge:
            if hinge.release is not None:
                breaks.update(hinge.release.time_breaks())
        for event in self.scene.event:
            breaks.update(event.when.time_breaks())
        return breaks


def user_parameters(element: Element, given: Mapping[str, float], where: str) -> tuple[float, ...]:
    """Numbers of a user's element in its order, defaults filled in.

    Raises SceneError naming the scene's element (`where`) for what is missing or out of bounds.
    """
    numbers = []
    for p in element.declared:
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
        numbers.append(float(value))
    return tuple(numbers)


def resize(packed: Packed, slots: int) -> None:
    """Room for tapes of `slots` numbers behind the blocks."""
    model = packed.model
    model.tape_slots = max(int(model.tape_slots), slots)
    tail = 2 * (model.nq + model.nu) + model.n_values + 3 * model.n_drives + model.tape_slots
    model.workspace = model.scratch + tail


Texts = tuple[str, ...]


def _names(ffi: Any, descriptor: Any) -> tuple[Texts, Texts, Texts, Texts]:
    """(q names, q units, u names, u units) of a descriptor."""
    d = descriptor

    def read(array: Any, count: int) -> tuple[str, ...]:
        return tuple(prebuilt.text(ffi, array[i]) for i in range(count))

    return (
        read(d.q_names, d.nq), read(d.q_units, d.nq), read(d.u_names, d.nu), read(d.u_units, d.nu)
    )  # fmt: skip
