"""Every flexible body of a scene as numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .beam.modal_beams import BeamBodies
from .modal_body import ModalBody

if TYPE_CHECKING:
    from mstmm.scene import Scene


def modal_bodies(scene: Scene) -> dict[str, ModalBody]:
    """Name -> body, beams in the scene's order and then elastic bodies; those with
    model = "rigid" are left out.

    Raises SceneError for a body whose shapes, matrices or ports do not fit.
    """
    beams = BeamBodies(scene)
    found = {b.name: beams.body(b) for b in scene.beam if b.model != "rigid"}
    if scene.elastic:
        from .elastic.modal_elastic import elastic_bodies

        found |= elastic_bodies(scene)
    return found
