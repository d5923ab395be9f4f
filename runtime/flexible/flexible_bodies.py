"""The flexible bodies of a scene as `ModalBody`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .beam.modal_beams import BeamBodies
from .modal_body import ModalBody

if TYPE_CHECKING:
    from mstmm.scene import Scene


def modal_bodies(scene: Scene) -> dict[str, ModalBody]:
    """Modal bodies by name: beams, then elastic bodies; those with model = "rigid" are left out.

    Raises SceneError for a body whose shapes, matrices or ports do not fit.
    """
    beams = BeamBodies(scene)
    bodies = {beam.name: beams.body(beam) for beam in scene.beam if beam.model != "rigid"}
    if scene.elastic:
        from .elastic.modal_elastic import elastic_bodies

        bodies |= elastic_bodies(scene)
    return bodies
