"""Multi-blade coordinates: three or more equal branches that spin with a hub.

After Coleman and Feingold (1958) a coordinate of blade k of N is a sum of harmonics of the azimuth
of the blade,

    x_k(t) = sum over h of a_h(t) exp(i h (W t + 2 pi k / N)),  |h| <= N / 2.

The same sum at the azimuths of the blades at t = 0,

    y_k(t) = sum over h of a_h(t) exp(2 pi i h k / N),

is the pattern of the rotor in the fixed frame.  Then y' = x' + R y with a circulant R, which turns
harmonic h at the rate -h W.  The collective component (mean of all blades) and, for even N, the
differential component (alternating signs) are unchanged.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array, Integers

from ...engine.looped_engine import Probe
from ...engine.quantity_registry import POINT_COLUMNS

if TYPE_CHECKING:
    from ...packing.packed_scene import PackedScene
    from ..linear_equations import LinearEquations

#: Smallest number of blades with constant coefficients in the fixed frame.
_FEWEST = 3
#: Tolerance for equal azimuths (rad) and equal distances from the axis (relative).
_EQUAL = 1e-6


@dataclass(frozen=True)
class Blades:
    """Equal branches of one hub in the order of their azimuths.

    Attributes:
        bodies: (blades, b) indices of their bodies in the tree.
        coordinates: (blades, m) indices among the perturbations of a linear model.
        speed: magnitude of the angular velocity of the hub, rad/s.
    """

    bodies: Integers
    coordinates: Integers
    speed: float

    @property
    def rates(self) -> Array:
        """Circulant R (blades, blades), 1/s, of one coordinate of all blades."""
        count = len(self.coordinates)
        k = np.arange(count)
        h = np.arange(1, (count - 1) // 2 + 1)[:, None, None]
        turns = h * np.sin(2 * np.pi * h * (k[:, None] - k) / count)
        return np.asarray(2 * self.speed / count * turns.sum(axis=0))


@dataclass(frozen=True)
class _Branch:
    """Branch with tree indices `bodies` and perturbation indices `coordinates`.

    Branches of equal `form` have the same hinges and free perturbations.
    """

    bodies: tuple[int, ...]
    coordinates: tuple[int, ...]
    form: tuple[object, ...]


def find_blades(linear: LinearEquations) -> list[Blades]:
    """Groups of equal branches on spinning hubs, equally spaced about the spin axis."""
    packed = linear.model.looped.packed
    points = _mass_centres(linear)
    blade_groups: list[Blades] = []
    for hub, link in enumerate(packed.topology.links):
        by_form: dict[tuple[object, ...], list[_Branch]] = {}
        for child in link.children if len(link.children) >= _FEWEST else ():
            branch = _branch(linear, packed, child)
            if branch.coordinates:
                by_form.setdefault(branch.form, []).append(branch)
        groups = (_arrange_blades(points, hub, group) for group in by_form.values())
        blade_groups += [group for group in groups if group is not None]
    return blade_groups


def _branch(linear: LinearEquations, packed: PackedScene, root: int) -> _Branch:
    """Branch outboard from body `root`; its form lists hinges and free perturbations in order."""
    bodies, coordinates, form = [], list[int](), list[object]()
    row_by_speed = {speed: k for k, speed in enumerate(linear.free_speed_indices)}
    for tree_index in _outwards(packed, root):
        bodies.append(tree_index)
        body, hinge = packed.topology.scene_indices(tree_index)
        of_hinge = packed.layout.hinges.get(packed.scene.hinges[hinge].name)
        of_body = packed.layout.modal.get(packed.scene.bodies.name(body))
        for slots in (of_hinge, of_body):
            free = (
                [] if slots is None else [k for k in range(slots.nu) if slots.u + k in row_by_speed]
            )
            form.append((None if slots is None else slots.type, tuple(free)))
            coordinates += [row_by_speed[slots.u + k] for k in free] if slots is not None else []
        form.append(len(packed.topology.links[tree_index].children))
    return _Branch(tuple(bodies), tuple(coordinates), tuple(form))


def _outwards(packed: PackedScene, root: int) -> Iterator[int]:
    """Tree indices of a body and all bodies outboard of it, depth first."""
    waiting = [root]
    while waiting:
        tree_index = waiting.pop()
        yield tree_index
        waiting += reversed(packed.topology.links[tree_index].children)


def _mass_centres(linear: LinearEquations) -> Array:
    """Motion of the mass centres (bodies, 24) in tree order; columns of `Observation.points`."""
    packed, state, engine = linear.model.looped.packed, linear.state, linear.model.looped
    names = [packed.scene.bodies.name(body) for body in packed.topology.order]
    probes = [Probe(packed.end(name)[0], packed.end(name)[1], packed.mass_center(name))
              for name in names]  # fmt: skip
    of = np.array([state.t]), state.q[None], state.u[None], engine.start_memory()[None]
    return np.asarray(engine.observe(*of, probes, parts=("points",)).points[0])


def _arrange_blades(points: Array, hub: int, group: list[_Branch]) -> Blades | None:
    """Branches ordered by azimuth about the spin axis of the hub; None if not equally spaced."""
    spin = points[hub, POINT_COLUMNS["angular_velocity"]]
    speed = float(np.linalg.norm(spin))
    if len(group) < _FEWEST or not speed:
        return None
    axis = spin / speed
    across = np.linalg.svd(axis[None])[2][1:]
    across[1] = np.cross(axis, across[0])
    means = np.array([points[list(branch.bodies), :3].mean(axis=0) for branch in group])
    plane = (means - means.mean(axis=0)) @ (across.T @ [1, 1j])
    radius, order = np.abs(plane), np.argsort(np.angle(plane))
    steps = np.angle(plane[np.roll(order, -1)] / plane[order]) if radius.all() else np.zeros(1)
    even = np.abs(steps - 2 * np.pi / len(group)).max() <= _EQUAL
    if not even or np.ptp(radius) > _EQUAL * radius.max():
        return None
    bodies, coordinates = (
        np.array([getattr(group[k], name) for k in order]) for name in ("bodies", "coordinates")
    )
    return Blades(bodies, coordinates, speed)
