"""Scene -> System -> records of the looped engine."""

from __future__ import annotations

from collections.abc import Mapping

from mstmm.scene import Scene

from ..flexible.modal_body import ModalBody
from ..kernels import prebuilt
from .elements import Known
from .internal import system_of
from .packed import Packed, resize
from .product import attach
from .records.model import write


def pack(
    scene: Scene,
    known: Known | None = None,
    product_accuracy: float | None = None,
    *,
    align: bool = True,
    flexible: Mapping[str, ModalBody] | None = None,
) -> Packed:
    """Engine arrays of a scene; as `system_of`.

    With `product_accuracy` accelerations come from the plain product of classical matrices, which
    may deviate from the Riccati sweep by that much.
    """
    system, frames = system_of(scene, known, align=align, flexible=flexible)
    ffi, lib = prebuilt.module()
    written = write(system, frames.elements)
    packed = Packed(
        **vars(frames), system=system, ffi=ffi, lib=lib, model=written.model, written=written,
        scratch=written.scratch,
    )  # fmt: skip
    if product_accuracy is not None:
        attach(packed, product_accuracy)
    resize(packed, written.slots)  # tapes of events are laid out later and may need more
    return packed
