"""Packing of a scene: its system and the records of the looped engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

from mstmm.scene import Scene

from ..flexible.modal_body import ModalBody
from ..kernels import prebuilt_kernels
from . import product_sweep, qr_sweep
from .merging.simplification import LINKED, WELDS, SimplifyOptions
from .packed_scene import PackedScene, enable_refinement, resize_workspace
from .records.model_record import write_model
from .scene_elements import Known
from .scene_frames import Frames
from .system import System
from .system_builder import system_of


def pack(
    scene: Scene,
    known: Known | None = None,
    product_accuracy: float | None = None,
    *,
    sweep: str = "riccati",
    align: bool = True,
    flexible: Mapping[str, ModalBody] | None = None,
    simplify: SimplifyOptions = LINKED,
) -> PackedScene:
    """Pack a scene; arguments as in `system_of`.

    With `product_accuracy` accelerations come from the product of classical matrices, which may
    deviate from the Riccati sweep by at most that.  With `sweep` "qr" they come from the QR sweep,
    with "refined" from the Riccati sweep with one refinement.
    """
    system, frames = system_of(scene, known, align=align, flexible=flexible, simplify=simplify)
    packed = packed_system(system, frames)
    if (
        product_accuracy is not None and not system.has_loops
    ):  # with loops, it follows their analysis
        product_sweep.enable_product_sweep(packed, product_accuracy)
    if sweep == "qr":
        qr_sweep.enable_qr_sweep(packed)
    if sweep == "refined":
        enable_refinement(packed, 1)
    resize_workspace(packed, packed.written.slots)
    return packed


def without_merging(packed: PackedScene) -> PackedScene:
    """Pack again without merging welded bodies; inputs, state and memory are the same."""
    if not any(record.kind == WELDS for record in packed.simplified):
        return packed
    simplify = {kind: value for kind, value in packed.simplify.items() if kind != WELDS}
    system, frames = system_of(
        packed.user_scene, packed.elements.known, flexible=packed.modal, simplify=simplify
    )
    current = packed.system
    couplings = tuple(
        replace(coupling, constant=other.constant, repeats=other.repeats)
        for coupling, other in zip(system.couplings, current.couplings, strict=True)
    )
    closures = tuple(
        replace(closure, directions=other.directions, choice=other.choice)
        for closure, other in zip(system.closures, current.closures, strict=True)
    )
    system = replace(
        system, inputs=current.inputs, held_inputs=current.held_inputs,
        depends_on_time=current.depends_on_time, n_memory=current.n_memory, couplings=couplings,
        closures=closures,
    )  # fmt: skip
    unmerged = packed_system(system, frames)
    unmerged.held_input_names = packed.held_input_names
    if packed.qr:
        qr_sweep.enable_qr_sweep(unmerged)
    if packed.refined:
        enable_refinement(unmerged, int(packed.model.refines))
    resize_workspace(unmerged, unmerged.written.slots)
    return unmerged


def packed_system(system: System, frames: Frames) -> PackedScene:
    """Pack a system, such as a variant of that of the scene."""
    ffi, lib = prebuilt_kernels.module()
    written = write_model(system, frames.elements)
    frame_fields = {field.name: getattr(frames, field.name) for field in fields(Frames)}
    packed = PackedScene(
        **frame_fields, system=system, ffi=ffi, lib=lib, model=written.model, written=written,
        scratch=written.scratch,
    )  # fmt: skip
    resize_workspace(packed, written.slots)  # tapes of events are added later and may need more
    return packed
