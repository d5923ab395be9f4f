"""Geometry of bodies, of shapes given by the scene, of hinges, springs and the ground."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.numerics.rotations import Matrix, Vector
from mstmm.optional_packages import missing_package_error
from mstmm.scene import Hinge, Shape
from mstmm.scene.tables.body import BodyTable
from mstmm.scene.tables.hinge_frames import hinge_frames, initial_motion_axes

from ..flexible import motion as observed
from .frame_times import FrameTimes
from .scene_graph import DeformingSurface, Poses, Solid
from .solid_meshes import (
    Colour,
    Surface,
    axes_along,
    bar_surface,
    box_surface,
    capsule_surface,
    cylinder_surface,
    ellipsoid_surface,
    join_surfaces,
    tube_faces,
)

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ..result_record import Record

# --- rigid bodies from their ends, mass and inertia -----------------------------------------------

#: Radius of a bar relative to its length, usual and at most; bounds relative to the scene's size.
_RADIUS_TO_LENGTH, _MAX_RADIUS_TO_LENGTH = 0.035, 0.15
_MIN_RADIUS_TO_SIZE, _MAX_RADIUS_TO_SIZE = 0.0025, 0.012
#: Radius of the ball at the mass centre relative to that of a bar.
_BALL_RADIUS_RATIO = 1.9
#: Points closer than this, relative to the size of the scene, are identical.
_POINT_TOLERANCE = 1e-6
#: A box of equal inertia is drawn if its edges are below this, relative to the size of the scene:
#: with bars, and for bodies without other data.
_MAX_BOX_BESIDE_BARS, _MAX_BOX_ALONE = 0.6, 4.0


def rigid_body_solids(
    name: str, body: BodyTable, hub: bool, size: float, colour: Colour
) -> Iterator[Solid]:
    """Solids of a rigid body: bars to every end, and a ball at the mass centre.

    Bars start at the origin (`hub`: a hinge is attached there) or at the mass centre. The box of
    the same mass and inertia is added: visible without bars, transparent and hidden with bars.
    `size` in m is that of the scene.
    """
    centre = np.array(body.center_of_mass)
    root = np.zeros(3) if hub or body.type != "rigid" else centre
    points = [np.array(body.end_position(end)) for end in body.ends]
    if body.type == "rigid":
        points.append(centre)
    outer_points = [p for p in points if np.linalg.norm(p - root) > _POINT_TOLERANCE * size]
    radii = [bar_radius(float(np.linalg.norm(p - root)), size) for p in outer_points]
    owner = f"bodies/{name}"
    if outer_points:
        bars = [bar_surface(root, p, r) for p, r in zip(outer_points, radii, strict=True)]
        yield Solid(owner, "bars", join_surfaces(bars), colour)
    radius = _BALL_RADIUS_RATIO * (max(radii) if radii else _MAX_RADIUS_TO_SIZE * size)
    inertia_box = equal_inertia_box(
        body, size, _MAX_BOX_BESIDE_BARS if outer_points else _MAX_BOX_ALONE
    )
    if inertia_box is not None:
        opacity, hidden = (0.3, True) if outer_points else (1.0, False)
        yield Solid(owner, "inertia", inertia_box, colour, opacity, hidden)
    if (body.mass and outer_points) or inertia_box is None:
        ball = ellipsoid_surface((radius, radius, radius), 12).with_pose(centre)
        red, green, blue = (int(0.55 * c) for c in colour)
        yield Solid(owner, "mass", ball, (red, green, blue))


def bar_radius(length: float, size: float) -> float:
    """Radius in m of a bar of this length in a scene of this size."""
    usual = float(
        np.clip(_RADIUS_TO_LENGTH * length, _MIN_RADIUS_TO_SIZE * size, _MAX_RADIUS_TO_SIZE * size)
    )
    return min(usual, _MAX_RADIUS_TO_LENGTH * length)


def body_bar_radius(body: BodyTable, size: float) -> float:
    """Radius in m of the thickest bar of a body, or the largest radius if it has no bar."""
    ends = [np.linalg.norm(body.end_position(end)) for end in body.ends]
    longest = float(max(ends, default=0.0))
    return bar_radius(longest, size) if longest > 0 else _MAX_RADIUS_TO_SIZE * size


def equal_inertia_box(
    body: BodyTable, size: float, most: float = _MAX_BOX_BESIDE_BARS
) -> Surface | None:
    """Homogeneous box with the same mass, mass centre and inertia.

    None if there is none, or if it would hide the scene: larger than `most` times its size.

    Edges a, b, c have moments m (b^2 + c^2) / 12 and so on, so a^2 = 6 (Jy + Jz - Jx) / m.
    """
    if body.type != "rigid" or not body.mass:
        return None
    moments, axes = np.linalg.eigh(np.array(body.inertia_matrix))
    squares = 6 * (moments.sum() - 2 * moments) / body.mass
    edges = np.sqrt(np.clip(squares, 0.0, None))
    if not edges.max() > _MAX_RADIUS_TO_SIZE * size or edges.max() > most * size:
        return None
    edges = np.maximum(edges, _MIN_RADIUS_TO_SIZE * size)
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    return box_surface(edges).with_pose(body.center_of_mass, axes)


def body_centre(body: BodyTable) -> Array:
    """Label position of a body: its mass centre, or the mean of its ends."""
    if body.type == "rigid" and body.mass:
        return np.array(body.center_of_mass)
    ends = [body.end_position(end) for end in body.ends]
    return np.mean([(0.0, 0.0, 0.0), *ends], axis=0)


# --- beams as bent tubes, elastic bodies by their meshes ------------------------------------------

#: Sections of a tube and corners of each section.
_STATION_COUNT, _TUBE_CORNERS = 25, 8
#: Largest number of nodes drawn of a body without a mesh.
_MAX_DRAWN_NODES = 400


def beam_tube(
    run: Record, name: str, when: FrameTimes, poses: Poses, size: float, colour: Colour
) -> DeformingSurface:
    """Surface of a beam in bending and twist, with unscaled deflections."""
    motion = motion_at(run, name, when, poses)
    length = float(motion.length)
    x = np.linspace(0.0, length, _STATION_COUNT)
    radius = np.pad(_section_radii(motion, x, length, size), 1, mode="edge")
    radius = np.pad(radius, 1)  # discs close its ends, with sharp rims
    x = np.pad(x, 2, mode="edge")
    angles = 2 * np.pi * np.arange(_TUBE_CORNERS) / _TUBE_CORNERS
    circle = np.stack([np.zeros(_TUBE_CORNERS), np.cos(angles), np.sin(angles)], axis=1)
    rings = radius[:, None, None] * circle
    sections = observed.section_rotation_matrices(motion, x)
    axis = observed.local_axis(motion, x)
    local = axis[:, :, None] + np.einsum("fmij,maj->fmai", sections, rings)
    inertial = poses.position[:, None] + motion.outward(local.reshape(len(local), -1, 3))
    return DeformingSurface(f"beams/{name}", inertial, tube_faces(len(x), _TUBE_CORNERS), colour)


def elastic_surface(
    run: Record, name: str, when: FrameTimes, poses: Poses, r: float, colour: Colour
) -> DeformingSurface:
    """Surface of an elastic body, deformed by its shape functions to first order.

    Its outer surface if a mesh is known, else every node as a dot of radius r (m).
    """
    motion = motion_at(run, name, when, poses)
    skin = motion.body.skin
    assert skin is not None
    local = skin.nodes + np.einsum("cNn,fn->fNc", skin.phi, motion.eta)
    faces = skin.faces
    if not len(faces):
        node_selection = slice(None, None, -(-local.shape[1] // _MAX_DRAWN_NODES))
        dot = ellipsoid_surface((r, r, r), 4)
        local = local[:, node_selection, None] + dot.vertices
        starts = len(dot.vertices) * np.arange(local.shape[1])
        faces = (starts[:, None, None] + dot.faces).reshape(-1, 3)
    inertial = poses.position[:, None] + motion.outward(local.reshape(len(local), -1, 3))
    return DeformingSurface(f"elastic/{name}", inertial, faces, colour)


def motion_at(run: Record, name: str, when: FrameTimes, poses: Poses) -> observed.Motion:
    """Motion of a body at the frame times; rates that are not drawn are zero."""
    motion = run._flexible.motion(name).select_samples(when.samples)
    eta = when.interpolate_hermite(motion.eta, motion.etad)
    return still_motion(motion.body, when.times, eta, poses.position, poses.rotation())


def still_motion(
    body: ModalBody, t: Array, eta: Array, position: Array, rotation: Array
) -> observed.Motion:
    """Motion of a body with modal coordinates eta (f, n), of which no rate is known: all are 0.

    `position` (f, 3) and `rotation` (f, 3, 3) are those of its frame.
    """
    rates, still = np.zeros_like(eta), np.zeros((len(eta), 3))
    return observed.Motion(
        body, t, eta, rates, rates, position, rotation, still, still, still, still
    )


def _section_radii(shown: observed.Motion, x: Array, length: float, size: float) -> Array:
    """Radii (m,) in m of round sections with the same stiffness ratio, within visible limits.

    EI / EA = r^2 / 4.
    """
    sections = observed.axis_of(shown.body, "view").sections(x)
    usual_radius = bar_radius(length, size)
    stretch, bend = np.asarray(sections.EA), np.maximum(sections.EI_y, sections.EI_z)
    with np.errstate(divide="ignore", invalid="ignore"):
        solid_radius = 2 * np.sqrt(bend / stretch)
    solid_radius = np.where(
        np.isfinite(solid_radius) & (solid_radius > 0), solid_radius, usual_radius
    )
    return np.clip(solid_radius, 0.4 * usual_radius, 2.5 * usual_radius)


# --- shapes that a scene gives to its bodies, ends and the ground ---------------------------------

#: Corners around a shape, and largest number of triangles of a mesh.
_SHAPE_CORNERS, _MAX_TRIANGLES = 32, 200_000


def shape_solid(
    shape: Shape, at: Vector, axes: Matrix, colour: Colour, kept: Mapping[str, bytes]
) -> Solid:
    """Solid of a shape on an end at `at` (m) with `axes` (end to body), in the axes of its body.

    `kept`: contents of mesh files stored with the run, by path; others are read now.
    """
    local_surface = _shape_surface(shape, kept).with_pose(shape.position, np.array(shape.rotation))
    owner = "ground" if shape.is_on_ground else f"bodies/{shape.owner}"
    if shape.color is not None:
        red, green, blue = bytes.fromhex(shape.color[1:])
        colour = red, green, blue
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
        return ellipsoid_surface((radius, radius, radius), _SHAPE_CORNERS)
    return (cylinder_surface if shape.type == "cylinder" else capsule_surface)(
        radius, length, _SHAPE_CORNERS
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


# --- hinges by their degrees of freedom, coils of springs, ground blocks --------------------------

HINGE_COLOUR: Colour = (60, 66, 74)
GROUND_COLOUR: Colour = (120, 126, 134)
SPRING_COLOUR: Colour = (150, 110, 30)

#: Turns of a coil, points in each, and its radius relative to its greatest length.
_COIL_TURNS, _POINTS_PER_TURN, _COIL_RADIUS_TO_LENGTH = 8, 10, 0.08


def hinge_glyph(hinge: Hinge, r: float) -> Surface | None:
    """Glyph of a hinge in the axes of its outboard end; None for a free hinge. `r` in m.

    Each rotation axis is a pin, each sliding axis a square rail; three rotations are a ball, and a
    hinge without either a small block; any other hinge is a ball as well.
    """
    facts = hinge.facts
    if facts is None:
        return ellipsoid_surface((r, r, r), 8)
    if facts.free_body:
        return None
    if facts.welds:
        return box_surface((1.3 * r, 1.3 * r, 1.3 * r))
    axes = np.array(hinge_frames(hinge)[1])
    # Translation and rotation of each speed at the start, axes of the outboard end.
    motions = [(np.array(t), np.array(w)) for t, w in initial_motion_axes(hinge) or ()]
    slides = [t for t, w in motions if np.linalg.norm(t) > 0 and not np.linalg.norm(w) > 0]
    parts = []
    if len(facts.turns) == 3 or not facts.constant_subspace:
        parts.append(ellipsoid_surface((r, r, r), 16))
    else:
        parts += [
            cylinder_surface(0.75 * r, 3.2 * r).with_pose(axes=axes_along(v))
            for _, v in motions
            if np.linalg.norm(v) > 0
        ]
    if len(slides) == 2:
        parts.append(box_surface((5 * r, 5 * r, 0.4 * r)).with_pose(axes=axes))
    else:
        parts += [
            box_surface((1.1 * r, 1.1 * r, 7 * r)).with_pose(axes=axes_along(v)) for v in slides
        ]
    if facts.frame == "crossing":
        second = hinge.unit_axis if hinge.unit_axis2 is None else hinge.unit_axis2
        parts = [
            cylinder_surface(0.6 * r, 4 * r).with_pose(axes=axes_along(v))
            for v in (hinge.unit_axis, second)
        ]
    return join_surfaces(parts) if parts else ellipsoid_surface((r, r, r), 8)


def spring_coil(start: Array, end: Array, widest: float) -> Array:
    """Points (f, n, 3) of a coil between moving points (f, 3); radius at most `widest` (m)."""
    radius = min(_COIL_RADIUS_TO_LENGTH * float(np.linalg.norm(end - start, axis=1).max()), widest)
    s = np.linspace(0.0, 1.0, _COIL_TURNS * _POINTS_PER_TURN + 1)
    angle = 2 * np.pi * _COIL_TURNS * np.clip((s - 0.12) / 0.76, 0.0, 1.0)
    radii = radius * np.clip(np.minimum(s - 0.08, 0.92 - s) / 0.06, 0.0, 1.0)
    difference = end - start
    points = []
    for a, d in zip(start, difference, strict=True):
        length = np.linalg.norm(d)
        axes = axes_along(d) if length > 0 else np.eye(3)
        local = np.stack([radii * np.cos(angle), radii * np.sin(angle), s * length], axis=1)
        points.append(a + local @ axes.T)
    return np.array(points)
