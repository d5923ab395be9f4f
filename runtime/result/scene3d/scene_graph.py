"""Scene graph of a run: solids on moving bodies, deforming surfaces, lines, frame times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mstmm.array_validation import Array

from .solid_meshes import Colour, Faces, Surface


@dataclass(frozen=True)
class Poses:
    """Poses over f frames: position (f, 3) in m, quaternion (f, 4) w, x, y, z to inertial axes."""

    position: Array
    quaternion: Array

    def rotation(self) -> Array:
        """Rotation matrices (f, 3, 3) from axes of the owner to inertial axes."""
        w, x, y, z = self.quaternion.T
        rows = [
            1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
        ]  # fmt: skip
        return np.stack(rows, axis=1).reshape(-1, 3, 3)

    def pose_at(self, k: int) -> tuple[Array, Array]:
        """Position (3,) and axes (3, 3) at frame k."""
        pose = Poses(self.position[k : k + 1], self.quaternion[k : k + 1])
        return self.position[k], pose.rotation()[0]

    def inertial_points(self, points: Array) -> Array:
        """Inertial positions (f, n, 3) of points (n, 3) fixed in the axes."""
        return self.position[:, None] + np.einsum("fij,nj->fni", self.rotation(), points)


@dataclass(frozen=True)
class Solid:
    """Surface fixed in the axes of `owner`: "bodies/rod1", "hinges/elbow", "ground"."""

    owner: str
    part: str
    surface: Surface
    colour: Colour
    opacity: float = 1.0
    hidden: bool = False  #: until it is asked for


@dataclass(frozen=True)
class DeformingSurface:
    """Surface with moving vertices (f, n, 3); inertial axes."""

    name: str
    vertices: Array
    faces: Faces
    colour: Colour


@dataclass(frozen=True)
class Line:
    """Polyline over the frames, (f, n, 3); inertial axes.

    A trail, (1, n, 3), is the path of a point from the first frame to the last, with points evenly
    spaced in time.
    """

    name: str
    points: Array
    colour: Colour
    width: float = 1.5

    def points_at(self, k: int, moments: int) -> Array:
        """Line (m, 3) at frame k; of a trail, the part covered by then."""
        if len(self.points) > 1 or moments < 2:
            return self.points[min(k, len(self.points) - 1)]
        shown_count = (self.points.shape[1] - 1) * k // (moments - 1)
        return self.points[0, : shown_count + 1]


@dataclass(frozen=True)
class ObjectLabel:
    """Label of an owner on the page: lines of text, and numbers (f, k) with labels and units."""

    name: str
    text: tuple[str, ...]
    anchor: Array  #: (3,) where the owner is pointed at, in its axes
    labels: tuple[tuple[str, str], ...] = ()
    values: Array = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True)
class SceneGraph:
    """Drawn objects over the frame times `times` (f,) in s.

    Attributes:
        title: title of the page.
        speed: seconds of the run per second of a film.
        up: (3,) unit vector that points up in the picture.
        poses: owner -> its axes over the frames; "ground" has none.
        labels: owner -> its label on the page.
        notes: notes on the drawing for readers.
        clock: what the frame times are, and their unit.
        choices: prefixes of owners, of which one is shown at a time; if empty, all are.
    """

    title: str
    times: Array
    speed: float
    up: Array
    poses: Mapping[str, Poses]
    solids: tuple[Solid, ...]
    deforming_surfaces: tuple[DeformingSurface, ...]
    lines: tuple[Line, ...]
    labels: Mapping[str, ObjectLabel]
    notes: tuple[str, ...] = ()
    clock: tuple[str, str] = ("t", "s")
    choices: tuple[str, ...] = ()

    def with_scale(self, factor: float) -> SceneGraph:
        """Scene graph scaled by a factor; the values of labels are unchanged."""
        return replace(
            self,
            poses={
                owner: replace(pose, position=factor * pose.position)
                for owner, pose in self.poses.items()
            },
            solids=tuple(
                replace(item, surface=item.surface.with_scale(factor)) for item in self.solids
            ),
            deforming_surfaces=tuple(
                replace(item, vertices=factor * item.vertices) for item in self.deforming_surfaces
            ),
            lines=tuple(replace(item, points=factor * item.points) for item in self.lines),
            labels={
                owner: replace(label, anchor=factor * label.anchor)
                for owner, label in self.labels.items()
            },
        )

    @cached_property
    def cloud(self) -> Array:
        """Inertial points (n, 3) that enclose everything that is drawn, over all frames."""
        clouds = [_sampled_points(line.points) for line in self.lines]
        clouds += [_sampled_points(bent.vertices) for bent in self.deforming_surfaces]
        for solid in self.solids:
            if not solid.hidden:
                clouds.append(self._corners(solid))
        return np.concatenate(clouds) if clouds else np.zeros((1, 3))

    def _corners(self, solid: Solid) -> Array:
        low, high = solid.surface.vertices.min(axis=0), solid.surface.vertices.max(axis=0)
        corners = low + _UNIT_BOX_CORNERS * (high - low)
        pose = self.poses.get(solid.owner)
        return corners if pose is None else _sampled_points(pose.inertial_points(corners))

    def corners(self) -> tuple[Array, Array]:
        """Least and largest inertial coordinates (3,) of everything drawn, in all frames."""
        return self.cloud.min(axis=0), self.cloud.max(axis=0)

    @property
    def digits(self) -> int:
        """Number of decimals that distinguishes its frame times, in s."""
        duration = float(self.times[-1] - self.times[0]) or 1.0
        return int(np.clip(3 - np.floor(np.log10(duration)), 0, 12))

    @cached_property
    def size(self) -> float:
        """Diagonal (m) of the box that contains everything; 1 for a scene that is a point."""
        low, high = self.corners()
        return float(np.linalg.norm(high - low)) or 1.0


#: Corners of a unit box.
_UNIT_BOX_CORNERS = np.array(
    [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
)
#: Largest number of frames examined for the size of the scene.
_MAX_SIZE_SAMPLES = 60


def _sampled_points(points: Array) -> Array:
    """Points (f, n, 3) at some of the frames, as (m, 3)."""
    return points[:: max(1, len(points) // _MAX_SIZE_SAMPLES)].reshape(-1, 3)


# --- several scenes on one page, shown one at a time: modes, rows of a batch ----------------------

Part = tuple[str, SceneGraph]


def combine_stages(title: str, parts: Sequence[Part]) -> SceneGraph:
    """Combine scenes over the same frame times; names of objects are prefixed by their part."""
    stages = [(f"{name}/", stage) for name, stage in parts]
    return replace(
        parts[0][1],
        title=title,
        notes=tuple(dict.fromkeys(note for _, stage in stages for note in stage.notes)),
        choices=tuple(name for name, _ in parts),
        poses={f"{at}{owner}": pose for at, stage in stages for owner, pose in stage.poses.items()},
        labels={
            f"{at}{owner}": text for at, stage in stages for owner, text in stage.labels.items()
        },
        solids=tuple(
            replace(item, owner=f"{at}{item.owner}")
            for at, stage in stages
            for item in stage.solids
        ),
        deforming_surfaces=tuple(
            replace(item, name=f"{at}{item.name}")
            for at, stage in stages
            for item in stage.deforming_surfaces
        ),
        lines=tuple(
            replace(item, name=f"{at}{item.name}") for at, stage in stages for item in stage.lines
        ),
    )
