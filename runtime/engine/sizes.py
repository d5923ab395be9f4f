"""Characteristic scale of each coordinate, relative to which changes are small or large."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from mstmm.arrays import Array
from mstmm.scene import Scene

from ..flexible.modal_body import ModalBody
from ..flexible.sizes import modal_sizes, radius_of_gyration
from ..pack.layout import Layout

#: Distances in a scene that are rounding of zero: relative to the radii of gyration, and in m if
#: all masses are points.
_NO_LENGTH, _NO_METRES = 1e-3, 1e-5


class Sized(Protocol):
    """Compiled scene, as far as characteristic scales need it."""

    @property
    def scene(self) -> Scene: ...
    @property
    def layout(self) -> Layout: ...
    @property
    def flexible(self) -> Mapping[str, ModalBody]: ...
    @property
    def nu(self) -> int: ...


def speed_sizes(model: Sized) -> Array:
    """Characteristic scales (nu,): 1 rad, a length of the scene, m, or that of a mode."""
    layout, sizes = model.layout, np.ones(model.nu)
    length = scene_length(model)
    for slots in layout.hinges.values():
        along = [unit.startswith("m") for unit in slots.u_units]
        sizes[slots.u_slice] = np.where(along, length, 1.0)
    for name, slots in layout.modal.items():
        sizes[slots.u_slice] = modal_sizes(model.flexible[name])
    return sizes


def scene_length(model: Sized) -> float:
    """Largest distance within a body or between successive hinges, m.

    It is 1 if all are zero, or rounding of zero compared with the radii of gyration.
    """
    scene = model.scene
    places = [hinge.position for hinge in scene.hinge]
    places += [chain.position for chain in scene.chain]
    for body in (*scene.body, *(one for chain in scene.chain for one in chain.body)):
        places += [body.center_of_mass, *(end.position for end in body.ends.values())]
    lengths = [float(np.linalg.norm(place)) for place in places]
    lengths += [radius_of_gyration(body) for body in model.flexible.values()]
    length = max(lengths, default=0.0)
    rigid = [body for body in scene.bodies.by_name.values() if hasattr(body, "inertia")]
    radii = [np.sqrt(sum(one.inertia[:3]) / 2 / one.mass) for one in rigid if one.mass > 0]
    radius = float(max(radii, default=0.0))
    least = _NO_LENGTH * radius if radius else _NO_METRES
    return length if length > least else 1.0
