"""Characteristic scale of each coordinate: reference for small and large changes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene import Scene

from ..flexible.modal_body import ModalBody
from ..flexible.modal_scales import modal_sizes, radius_of_gyration
from ..packing.coordinate_layout import Layout

#: Scene length below which distances are rounding errors: relative to the largest radius of
#: gyration, and in m if all masses are points.
_MIN_LENGTH_RATIO, _MIN_LENGTH_M = 1e-3, 1e-5


class HasScales(Protocol):
    """Part of a compiled scene that determines characteristic scales."""

    @property
    def scene(self) -> Scene: ...
    @property
    def coordinate_layout(self) -> Layout: ...
    @property
    def flexible_bodies(self) -> Mapping[str, ModalBody]: ...
    @property
    def nu(self) -> int: ...


def speed_scales(model: HasScales) -> Array:
    """Characteristic scales (nu,) of the speeds: 1 rad, the scene length (m), or modal sizes."""
    layout, scales = model.coordinate_layout, np.ones(model.nu)
    length = scene_length(model)
    for slots in layout.hinges.values():
        is_length = [unit.startswith("m") for unit in slots.u_units]
        scales[slots.u_slice] = np.where(is_length, length, 1.0)
    for name, slots in layout.modal.items():
        scales[slots.u_slice] = modal_sizes(model.flexible_bodies[name])
    return scales


def scene_length(model: HasScales) -> float:
    """Largest distance within a body or between successive hinges, m.

    It is 1 if all distances are zero or rounding errors relative to the radii of gyration.
    """
    scene = model.scene
    positions = [hinge.position for hinge in scene.hinge]
    positions += [chain.position for chain in scene.chain]
    for body in (*scene.body, *(inner_body for chain in scene.chain for inner_body in chain.body)):
        positions += [body.center_of_mass, *(end.position for end in body.ends.values())]
    lengths = [float(np.linalg.norm(position)) for position in positions]
    lengths += [radius_of_gyration(body) for body in model.flexible_bodies.values()]
    length = max(lengths, default=0.0)
    rigid = [body for body in scene.bodies.by_name.values() if hasattr(body, "inertia")]
    radii = [
        np.sqrt(sum(inner_body.inertia[:3]) / 2 / inner_body.mass)
        for inner_body in rigid
        if inner_body.mass > 0
    ]
    radius = float(max(radii, default=0.0))
    min_length = _MIN_LENGTH_RATIO * radius if radius else _MIN_LENGTH_M
    return length if length > min_length else 1.0


def total_mass(model: HasScales) -> float:
    """Mass of all moving bodies, kg."""
    scene = model.scene
    mass = sum(body.mass for body in scene.body)
    mass += sum(chain.body_of(k).mass for chain in scene.chain for k in range(chain.count))
    for body in model.flexible_bodies.values():
        mass += sum(point.mass for point in body.points) if body.points else float(body.mass)
    return mass


def total_weight(model: HasScales) -> float:
    """Weight of all moving bodies, N."""
    return total_mass(model) * float(np.linalg.norm(model.scene.gravity))
