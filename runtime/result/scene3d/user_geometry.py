"""Geometry of the shapes that a scene gives to its bodies, its ends and the ground."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from mstmm.errors import SceneError
from mstmm.numerics.rotations import Matrix, Vector
from mstmm.optional_packages import missing_package_error
from mstmm.scene import Shape

from .scene_graph import Solid
from .solid_meshes import (
    Colour,
    Surface,
    box_surface,
    capsule_surface,
    cylinder_surface,
    ellipsoid_surface,
)

#: Corners around a shape, and largest number of triangles of a mesh.
_CORNERS_AROUND, _MAX_TRIANGLES = 32, 200_000


def shape_solid(
    shape: Shape, at: Vector, axes: Matrix, colour: Colour, kept: Mapping[str, bytes]
) -> Solid:
    """Solid of a shape on an end at `at` (m) with `axes` (end to body), in the axes of its body.

    `kept`: contents of mesh files stored with the run, by path; others are read now.
    """
    local_surface = _shape_surface(shape, kept).with_pose(shape.position, np.array(shape.rotation))
    owner = "ground" if shape.is_on_ground else f"bodies/{shape.owner}"
    colour = colour if shape.color is None else _parse_colour(shape.color)
    return Solid(
        owner, shape.name, local_surface.with_pose(at, np.array(axes)), colour, shape.opacity
    )


def _shape_surface(shape: Shape, kept: Mapping[str, bytes]) -> Surface:
    if shape.type == "mesh":
        return _read_mesh(shape, kept.get(shape.file or ""))
    if shape.size is not None:
        return box_surface(shape.size)
    radius, length = shape.radius or 0.0, shape.length or 0.0
    if shape.type == "sphere":
        return ellipsoid_surface((radius, radius, radius), _CORNERS_AROUND)
    return (cylinder_surface if shape.type == "cylinder" else capsule_surface)(
        radius, length, _CORNERS_AROUND
    )


def _read_mesh(shape: Shape, content: bytes | None) -> Surface:
    """Read the triangles of a file, or of its stored content.

    SceneError for an invalid file, EnvironmentFailure without the extra that reads it.
    """
    try:
        import trimesh
    except ImportError as error:
        raise missing_package_error("view", f'the mesh of shape "{shape.name}"', error) from None
    path = Path(shape.file or "")
    if content is None and not path.is_file():
        raise SceneError(f'shape "{shape.name}": file: there is no file "{path}"')
    try:
        file = BytesIO(path.read_bytes() if content is None else content)
        mesh = trimesh.load_mesh(file, file_type=path.suffix[1:].lower(), process=False)
        vertices, faces = np.array(mesh.vertices, dtype=float), np.array(mesh.faces)
    except Exception as error:  # readers raise many types for invalid files
        raise SceneError(
            f'shape "{shape.name}": file "{path}" is not a readable mesh '
            f"({type(error).__name__}: {error})"
        ) from None
    if not len(faces) or len(faces) > _MAX_TRIANGLES or not np.isfinite(vertices).all():
        raise SceneError(
            f'shape "{shape.name}": file "{path}" holds {len(faces)} triangles; expected 1 to '
            f"{_MAX_TRIANGLES} with finite corners"
        )
    return Surface(vertices * (shape.scale or 1.0), faces.astype(np.int64))


def _parse_colour(text: str) -> Colour:
    return (int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16))
