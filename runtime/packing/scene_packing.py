"""Scene -> System -> records of the looped engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

from mstmm.scene import Scene

from ..flexible.modal_body import ModalBody
from ..kernels import prebuilt_kernels
from . import product_sweep, qr_sweep
from .merging.simplification import LINKED, WELDS, Words
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
    simplify: Words = LINKED,
) -> PackedScene:
    """Engine arrays of a scene; as `system_of`.

    With `product_accuracy` accelerations come from the plain product of classical matrices, which
    may deviate from the Riccati sweep by that much; where `sweep` is "qr" they come from the QR
    sweep, and where it is "refined" from the Riccati sweep, refined once.
    """
    system, frames = system_of(scene, known, align=align, flexible=flexible, simplify=simplify)
    packed = packed_system(system, frames)
    if product_accuracy is not None and not system.closes:  # closed loops go first
        product_sweep.enable_product_sweep(packed, product_accuracy)
    if sweep == "qr":
        qr_sweep.enable_qr_sweep(packed)
    if sweep == "refined":
        enable_refinement(packed, 1)
    resize_workspace(packed, packed.written.slots)
    return packed


def without_merging(packed: PackedScene) -> PackedScene:
    """The same with every body by itself, under the same inputs; states and memory are the same."""
    if not any(one.kind == WELDS for one in packed.simplified):
        return packed
    words = {word: given for word, given in packed.simplify.items() if word != WELDS}
    system, frames = system_of(
        packed.described, packed.elements.known, flexible=packed.modal, simplify=words
    )
    now = packed.system
    both = zip(system.couplings, now.couplings, strict=True)
    couplings = tuple(replace(one, kept=had.kept, repeats=had.repeats) for one, had in both)
    closures = tuple(
        replace(one, directions=known.directions, choice=known.choice)
        for one, known in zip(system.closures, now.closures, strict=True)
    )
    same = replace(
        system, inputs=now.inputs, held=now.held, by_time=now.by_time, n_memory=now.n_memory,
        couplings=couplings,
        closures=closures,
    )  # fmt: skip
    found = packed_system(same, frames)
    found.held = packed.held
    if packed.qr:
        qr_sweep.enable_qr_sweep(found)
    if packed.refined:
        enable_refinement(found, int(packed.model.refines))
    resize_workspace(found, found.written.slots)
    return found


def packed_system(system: System, frames: Frames) -> PackedScene:
    """Engine arrays of a system, such as one whose forces are others than the scene's."""
    ffi, lib = prebuilt_kernels.module()
    written = write_model(system, frames.elements)
    about = {field.name: getattr(frames, field.name) for field in fields(Frames)}
    packed = PackedScene(
        **about, system=system, ffi=ffi, lib=lib, model=written.model, written=written,
        scratch=written.scratch,
    )  # fmt: skip
    resize_workspace(packed, written.slots)  # tapes of events are laid out later and may need more
    return packed
