"""Scene -> arrays of the looped engine: one C record per body, law, load and force."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from mstmm.expression.expression import Expression
from mstmm.ir import KernelIR
from mstmm.ir.tape import Tape, compile_tape
from mstmm.scene import Scene, split
from mstmm.scene.checks.topology import build
from mstmm.scene.tables.hinge import HingeTable

from ..flexible.modal_body import ModalBody
from ..kernels import prebuilt
from ..kernels.records import Lookup
from ..kernels.tape import c_tape
from . import values
from .bodies import BodyRecords, Elements, Known, layout_of, user_parameters
from .flexible.expansion import Expanded, expand
from .laws import pack_laws
from .letting_go import releasable
from .links import attach_runs
from .packed import Packed, resize
from .product import attach


def expansion_of(scene: Scene, flexible: Mapping[str, ModalBody] | None = None) -> Expanded:
    """The scene of nodes; scenes without flexible bodies are their own.

    `flexible` are the numbers of the flexible bodies where they are known already.
    """
    if not (scene.beam or scene.elastic):
        return Expanded(scene, scene, {})
    from ..flexible.bodies import modal_bodies
    from .flexible.rigidified import rigidified

    rigid = rigidified(scene)
    expanded = expand(rigid.scene, modal_bodies(rigid.scene) if flexible is None else flexible)
    expanded.described, expanded.rigidified = scene, rigid
    expanded.nodes |= rigid.nodes
    return expanded


def pack(
    scene: Scene,
    known: Known | None = None,
    product_accuracy: float | None = None,
    *,
    align: bool = True,
    flexible: Mapping[str, ModalBody] | None = None,
) -> Packed:
    """Engine arrays of a scene; `known` are elements beyond the prebuilt ones.

    With `product_accuracy` accelerations come from the plain product of classical matrices, which
    may deviate from the Riccati sweep by that much.  Without `align` internal frames are those of
    the bodies' own hinges, whatever hangs on them: smooth functions of the scene's numbers.
    `flexible` are the numbers of the flexible bodies where they are known already.

    Raises SceneError for hinges that do not form a tree or types that nobody defines.
    """
    packed = _Packing(scene, known or {}, align, flexible).run()
    if product_accuracy is not None:
        attach(packed, product_accuracy)
        resize(packed, int(packed.model.tape_slots))
    return packed


class _Packing:
    """One pass over a scene; every method fills one part of the model."""

    def __init__(
        self,
        scene: Scene,
        known: Known,
        align: bool,
        flexible: Mapping[str, ModalBody] | None,
    ) -> None:
        self.expanded = expanded = expansion_of(scene, flexible)
        self.scene, self.elements, self.align = expanded.scene, Elements(known), align
        self.ffi, self.lib = prebuilt.module()
        self.kept: list[Any] = []
        self.topology = build(self.scene)
        self.releases = {name: i for i, name in enumerate(releasable(scene))}
        self.layout = layout_of(expanded, self.releases, self.elements)
        self.values = values.Values(self.layout)
        self.slots = 0

    def run(self) -> Packed:
        model = self.ffi.new("mstmm_model *")
        tree, scene = self.topology, self.scene
        bodies = BodyRecords(
            scene, tree, self.layout, self.elements, self.releases, self.ffi, self.lib, self.kept,
            self._c_tape, self.align, self.expanded,
        )  # fmt: skip
        records, behind = bodies.fill()
        model.scratch = bodies.modal.begin(behind)
        packed = Packed(
            scene, tree, self.layout, self.ffi, self.lib, model, records, bodies.placements,
            Lookup(scene.bodies, tree.place_of_body), Lookup(scene.hinges, tree.place_of_hinge),
            self.releases, 0, kept=self.kept, expanded=self.expanded,
        )  # fmt: skip
        packed.warnings += [w for body in packed.flexible.values() for w in body.warnings]
        self.kept.append(model)
        model.bodies, model.n_bodies = records.array, records.count
        model.n_flexible = len(self.expanded.bodies)
        for k in range(3):
            model.gravity[k] = scene.gravity[k]
        self._drives(packed)
        packed.n_memory = len(self.releases) + pack_laws(packed, self.values)
        self._loads(packed)
        self._forces(packed)
        self._tapes(packed)
        attach_runs(packed)
        self._sizes(packed)
        return packed

    def reals(self, numbers: tuple[float, ...]) -> Any:
        array = self.ffi.new("real[]", list(numbers) or [0.0])
        self.kept.append(array)
        return array

    # --- drives, loads, forces ------------------------------------------------------------------

    def _drives(self, packed: Packed) -> None:
        driven: list[tuple[int, int, Expression]] = []
        for place, hinge in self._driven_hinges():
            for k, entry in enumerate(hinge.drive or ()):
                if entry is not None:
                    driven.append((place, k, entry))
        records = self.ffi.new("mstmm_drive[]", max(1, len(driven)))
        for record, (body, k, _) in zip(records, driven, strict=False):
            record.body, record.coordinate, record.speed = body, k, k
        packed.model.drives, packed.model.n_drives = records, len(driven)
        self.kept.append(records)
        if driven:
            kernel = values.drive_kernel([entry for _, _, entry in driven])
            packed.model.drive_tape = self._expression(packed, "drives", kernel)

    def _driven_hinges(self) -> Iterator[tuple[int, HingeTable]]:
        """(place, table) of every hinge with a drive."""
        tables = len(self.scene.hinge)
        for run in self.topology.runs:
            if run.hinge < tables:
                if self.scene.hinge[run.hinge].drive is not None:
                    yield run.place, self.scene.hinge[run.hinge]
                continue
            chain = self.scene.chain[self.scene.hinges.member(run.hinge)[0]]
            if any(table.drive is not None for table in chain.hinge):
                for k in range(run.count):
                    yield run.place + k, chain.hinge_of(k)

    def _expression(self, packed: Packed, name: str, kernel: KernelIR) -> Any:
        packed.expressions[name] = kernel
        return self._c_tape(compile_tape(kernel))

    def _c_tape(self, tape: Tape) -> Any:
        self.slots = max(self.slots, tape.slots)
        return c_tape(self.ffi, tape, self.kept)

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
            record.axes_own = list(self._section_axes(reference) or own)
        packed.model.loads, packed.model.n_loads = records, len(self.scene.load)

    def _section_axes(self, reference: str) -> tuple[float, ...]:
        """Axes of a section of a flexible body (turned with it) in those of its end; else none."""
        node = self.expanded.nodes.get(reference)
        passage = self.expanded.passages.get(node or "")
        return () if passage is None else tuple(passage.port.rotation.T.ravel().tolist())

    def _forces(self, packed: Packed) -> None:
        records = self.ffi.new("mstmm_force[]", max(1, len(self.scene.spring)))
        self.kept.append(records)
        for index, (record, spring) in enumerate(zip(records, self.scene.spring, strict=False)):
            element = self.elements.get("force", spring.type, spring.name)
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
            else:
                given = user_parameters(element, spring.parameters, f'spring "{spring.name}"')
                record.p = self.reals(given)
        packed.model.forces, packed.model.n_forces = records, len(self.scene.spring)
        dragged = any(body.drag is not None for body in packed.flexible.values())
        packed.model.needs_pose = int(bool(self.scene.spring or self.scene.load or dragged))

    # --- sizes ------------------------------------------------------------------------------

    def _tapes(self, packed: Packed) -> None:
        packed.model.n_values = len(self.values)
        if len(self.values):
            packed.model.value_tape = self._expression(packed, "values", self.values.kernel())

    def _sizes(self, packed: Packed) -> None:
        model, layout = packed.model, self.layout
        model.nq, model.nu, model.n_memory = layout.nq, layout.nu, packed.n_memory
        resize(packed, self.slots)  # tapes of events are laid out later and may need more
