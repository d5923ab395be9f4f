"""Motions of order one, by coordinate: what a step in it is small or large beside."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array

if TYPE_CHECKING:
    from .flexible.modal_body import ModalBody
    from .model import Model


def speed_sizes(model: Model) -> Array:
    """(nu,) of every speed: 1 rad, a length of the scene in m, the size of a modal coordinate."""
    layout, sizes = model.layout, np.ones(model.nu)
    length = scene_length(model)
    for slots in layout.hinges.values():
        along = [unit.startswith("m") for unit in slots.u_units]
        sizes[slots.u_slice] = np.where(along, length, 1.0)
    for name, slots in layout.modal.items():
        sizes[slots.u_slice] = modal_sizes(model.flexible[name])
    return sizes


def modal_sizes(body: ModalBody) -> Array:
    """(n,) modal coordinates at which a section turns by 1 rad, or the mass moves by the body's own
    radius of gyration."""
    radius = _radius(body) or 1.0
    moved = np.sqrt(np.abs(np.diag(body.Mff)) / max(float(body.mass), 1e-300))
    turned = np.max([np.abs(p.theta).max(axis=0) for p in body.ports.values()], axis=0)
    if body.shapes is not None:
        inner = body.shapes.at(np.linspace(0.0, body.shapes.length, 2 * body.n + 3)).theta
        turned = np.maximum(turned, np.abs(inner).max(axis=(0, 1)))
    return np.asarray(1.0 / np.maximum(np.maximum(moved / radius, turned), 1e-300))


def scene_length(model: Model) -> float:
    """The largest distance within a body or from one hinge to the next, m; 1 if all are zero."""
    scene = model.scene
    places = [hinge.position for hinge in scene.hinge]
    places += [chain.position for chain in scene.chain]
    for body in (*scene.body, *(one for chain in scene.chain for one in chain.body)):
        places += [body.center_of_mass, *(end.position for end in body.ends.values())]
    lengths = [float(np.linalg.norm(place)) for place in places]
    lengths += [_radius(body) for body in model.flexible.values()]
    return max(lengths, default=0.0) or 1.0


def _radius(body: ModalBody) -> float:
    """Radius of gyration about the origin of the frame, m."""
    return float(np.sqrt(np.trace(body.second) / max(float(body.mass), 1e-300)))
