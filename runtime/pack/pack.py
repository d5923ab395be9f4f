"""Scene -> System -> records of the looped engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

from mstmm.scene import Scene

from ..flexible.modal_body import ModalBody
from ..kernels import prebuilt
from . import product, qr
from .elements import Known
from .frames import Frames
from .internal import system_of
from .packed import Packed, resize
from .records.model import write
from .system import System


def pack(
    scene: Scene,
    known: Known | None = None,
    product_accuracy: float | None = None,
    *,
    least_squares: bool = False,
    align: bool = True,
    flexible: Mapping[str, ModalBody] | None = None,
) -> Packed:
    """Engine arrays of a scene; as `system_of`.

    With `product_accuracy` accelerations come from the plain product of classical matrices, which
    may deviate from the Riccati sweep by that much; with `least_squares` from the QR sweep.
    """
    system, frames = system_of(scene, known, align=align, flexible=flexible)
    packed = packed_system(system, frames)
    if product_accuracy is not None and not system.closes:  # closed loops go first
        product.attach(packed, product_accuracy)
    if least_squares:
        qr.attach(packed)
    resize(packed, packed.written.slots)
    return packed


def packed_system(system: System, frames: Frames) -> Packed:
    """Engine arrays of a system, such as one whose forces are others than the scene's."""
    ffi, lib = prebuilt.module()
    written = write(system, frames.elements)
    about = {field.name: getattr(frames, field.name) for field in fields(Frames)}
    packed = Packed(
        **about, system=system, ffi=ffi, lib=lib, model=written.model, written=written,
        scratch=written.scratch,
    )  # fmt: skip
    resize(packed, written.slots)  # tapes of events are laid out later and may need more
    return packed
