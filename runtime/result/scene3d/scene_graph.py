"""Everything that is seen of a run: solids on bodies that move, what bends, lines, and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mstmm.array_validation import Array

from .solid_meshes import Colour, Faces, Surface


@dataclass(frozen=True)
class Poses:
    """Axes over f moments: position (f, 3) in m, quaternion (f, 4) w, x, y, z to inertial axes."""

    position: Array
    quaternion: Array

    def rotation(self) -> Array:
        """(f, 3, 3) axes of the owner to inertial axes."""
        w, x, y, z = self.quaternion.T
        rows = [
            1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
        ]  # fmt: skip
        return np.stack(rows, axis=1).reshape(-1, 3, 3)

    def at(self, k: int) -> tuple[Array, Array]:
        """Position (3,) and axes (3, 3) at moment k."""
        pose = Poses(self.position[k : k + 1], self.quaternion[k : k + 1])
        return self.position[k], pose.rotation()[0]

    def of(self, points: Array) -> Array:
        """(f, n, 3) inertial places of points (n, 3) that move with the axes."""
        return self.position[:, None] + np.einsum("fij,nj->fni", self.rotation(), points)


@dataclass(frozen=True)
class Solid:
    """A surface that moves with the axes of `owner`: "bodies/rod1", "hinges/elbow", "ground"."""

    owner: str
    part: str
    surface: Surface
    colour: Colour
    opacity: float = 1.0
    hidden: bool = False  #: until it is asked for


@dataclass(frozen=True)
class DeformingSurface:
    """A surface whose vertices (f, n, 3) move by themselves; inertial axes."""

    name: str
    vertices: Array
    faces: Faces
    colour: Colour


@dataclass(frozen=True)
class Line:
    """A broken line over the moments, (f, n, 3); inertial axes.  A trail, (1, n, 3), is the way of
    a point from the first moment to the last, its places evenly spread in time."""

    name: str
    points: Array
    colour: Colour
    width: float = 1.5

    def at(self, k: int, moments: int) -> Array:
        """(m, 3) the line at moment k; of a trail, what has been gone by then."""
        if len(self.points) > 1 or moments < 2:
            return self.points[min(k, len(self.points) - 1)]
        shown_count = (self.points.shape[1] - 1) * k // (moments - 1)
        return self.points[0, : shown_count + 1]


@dataclass(frozen=True)
class ObjectLabel:
    """What the page says of an owner: lines of text, and numbers (f, k) with labels and units."""

    name: str
    text: tuple[str, ...]
    anchor: Array  #: (3,) where the owner is pointed at, in its axes
    labels: tuple[tuple[str, str], ...] = ()
    values: Array = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True)
class SceneGraph:
    """What is seen, over moments `times` (f,) in s.

    Attributes:
        title: what the page is called.
        speed: seconds of the run per second of a film.
        up: (3,) unit vector that points up in the picture.
        poses: owner -> its axes over the moments; "ground" has none.
        told: owner -> what the page says of it.
        notes: what a reader should know of the drawing.
        clock: what the moments are, and their unit.
        choices: names in front of owners, of which one is looked at at a time; none: all are.
    """

    title: str
    times: Array
    speed: float
    up: Array
    poses: Mapping[str, Poses]
    solids: tuple[Solid, ...]
    bent: tuple[DeformingSurface, ...]
    lines: tuple[Line, ...]
    told: Mapping[str, ObjectLabel]
    notes: tuple[str, ...] = ()
    clock: tuple[str, str] = ("t", "s")
    choices: tuple[str, ...] = ()

    def scaled(self, factor: float) -> SceneGraph:
        """The same so many times as large; what is told stays what it is."""
        scaled_poses = {owner: replace(pose, position=factor * pose.position)
                 for owner, pose in self.poses.items()}  # fmt: skip
        solids = tuple(replace(item, surface=item.surface.scaled(factor)) for item in self.solids)
        bent = tuple(replace(item, vertices=factor * item.vertices) for item in self.bent)
        lines = tuple(replace(item, points=factor * item.points) for item in self.lines)
        told = {
            owner: replace(item, anchor=factor * item.anchor) for owner, item in self.told.items()
        }
        return replace(self, poses=scaled_poses, solids=solids, bent=bent, lines=lines, told=told)

    @cached_property
    def cloud(self) -> Array:
        """Inertial places (n, 3) that hold all that is drawn between them, over all moments."""
        clouds = [_sampled_points(line.points) for line in self.lines]
        clouds += [_sampled_points(bent.vertices) for bent in self.bent]
        for solid in self.solids:
            if not solid.hidden:
                clouds.append(self._corners(solid))
        return np.concatenate(clouds) if clouds else np.zeros((1, 3))

    def _corners(self, solid: Solid) -> Array:
        low, high = solid.surface.vertices.min(axis=0), solid.surface.vertices.max(axis=0)
        corners = low + _UNIT_BOX_CORNERS * (high - low)
        pose = self.poses.get(solid.owner)
        return corners if pose is None else _sampled_points(pose.of(corners))

    def corners(self) -> tuple[Array, Array]:
        """Least and largest inertial coordinates (3,) of all that is drawn, in all moments."""
        return self.cloud.min(axis=0), self.cloud.max(axis=0)

    @property
    def digits(self) -> int:
        """Decimals by which its moments are told apart, in s."""
        duration = float(self.times[-1] - self.times[0]) or 1.0
        return int(np.clip(3 - np.floor(np.log10(duration)), 0, 12))

    @cached_property
    def size(self) -> float:
        """The diagonal (m) of the box that holds everything; 1 of a scene that is a point."""
        low, high = self.corners()
        return float(np.linalg.norm(high - low)) or 1.0


#: Corners of a box of edges 1.
_UNIT_BOX_CORNERS = np.array(
    [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
)
#: Moments that are looked at to find how large everything is.
_MAX_SIZE_SAMPLES = 60


def _sampled_points(points: Array) -> Array:
    """Points (f, n, 3) at some of the moments, as (m, 3)."""
    return points[:: max(1, len(points) // _MAX_SIZE_SAMPLES)].reshape(-1, 3)
