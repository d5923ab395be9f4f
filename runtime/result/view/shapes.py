"""The shapes that a scene gives to its bodies, its ends and the ground."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from mstmm.errors import SceneError
from mstmm.extras import missing
from mstmm.numbers.rotations import Matrix, Vector
from mstmm.scene import Shape

from .solids import Colour, Surface, box, capsule, cylinder, ellipsoid
from .stage import Solid

#: Corners once around a shape, and triangles of a mesh at most.
_ROUND, _MOST = 32, 200_000


def solid(
    shape: Shape, at: Vector, axes: Matrix, colour: Colour, kept: Mapping[str, bytes]
) -> Solid:
    """A shape on an end that is at `at` (m) with `axes` (end to body) in the axes of its body.

    `kept`: contents of mesh files that came with the run, by path; others are read now.
    """
    own = _surface(shape, kept).placed(shape.position, np.array(shape.rotation))
    owner = "ground" if shape.is_on_ground else f"bodies/{shape.owner}"
    colour = colour if shape.color is None else _colour(shape.color)
    return Solid(owner, shape.name, own.placed(at, np.array(axes)), colour, shape.opacity)


def _surface(shape: Shape, kept: Mapping[str, bytes]) -> Surface:
    if shape.type == "mesh":
        return _mesh(shape, kept.get(shape.file or ""))
    if shape.size is not None:
        return box(shape.size)
    radius, length = shape.radius or 0.0, shape.length or 0.0
    if shape.type == "sphere":
        return ellipsoid((radius, radius, radius), _ROUND)
    return (cylinder if shape.type == "cylinder" else capsule)(radius, length, _ROUND)


def _mesh(shape: Shape, content: bytes | None) -> Surface:
    """The triangles of a file, or of what is known of its content.

    SceneError for a file that is none, EnvironmentFailure without the extra that reads it.
    """
    try:
        import trimesh
    except ImportError as error:
        raise missing("view", f'the mesh of shape "{shape.name}"', error) from None
    path = Path(shape.file or "")
    if content is None and not path.is_file():
        raise SceneError(f'shape "{shape.name}": file: there is no file "{path}"')
    try:
        file = BytesIO(path.read_bytes() if content is None else content)
        read = trimesh.load_mesh(file, file_type=path.suffix[1:].lower(), process=False)
        vertices, faces = np.array(read.vertices, dtype=float), np.array(read.faces)
    except Exception as error:  # whatever its readers make of a file that is none
        raise SceneError(
            f'shape "{shape.name}": file "{path}" is no mesh that can be read '
            f"({type(error).__name__}: {error})"
        ) from None
    if not len(faces) or len(faces) > _MOST or not np.isfinite(vertices).all():
        raise SceneError(
            f'shape "{shape.name}": file "{path}" holds {len(faces)} triangles; expected 1 to '
            f"{_MOST} with finite corners"
        )
    return Surface(vertices * (shape.scale or 1.0), faces.astype(np.int64))


def _colour(text: str) -> Colour:
    return (int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16))
