"""Geometry of beams as bent tubes and of elastic bodies by their meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ..flexible import motion as observed
from .body_geometry import bar_radius
from .frame_times import FrameTimes
from .scene_graph import DeformingSurface, Poses
from .solid_meshes import Colour, ellipsoid_surface, tube_faces

if TYPE_CHECKING:
    from ..result_record import Record

#: Sections of a tube and corners of each section.
_STATION_COUNT, _CORNERS_AROUND = 25, 8
#: Largest number of nodes drawn of a body without a mesh.
_MAX_DRAWN_NODES = 400


def beam_tube(
    run: Record, name: str, when: FrameTimes, poses: Poses, size: float, colour: Colour
) -> DeformingSurface:
    """Surface of a beam in bending and twist, with unscaled deflections."""
    motion = motion_at(run, name, when, poses)
    length = float(motion.shapes.length)
    x = np.linspace(0.0, length, _STATION_COUNT)
    radius = np.pad(_section_radii(motion, x, length, size), 1, mode="edge")
    radius = np.pad(radius, 1)  # discs close its ends, with sharp rims
    x = np.pad(x, 2, mode="edge")
    angles = 2 * np.pi * np.arange(_CORNERS_AROUND) / _CORNERS_AROUND
    circle = np.stack([np.zeros(_CORNERS_AROUND), np.cos(angles), np.sin(angles)], axis=1)
    rings = radius[:, None, None] * circle
    sections = observed.section_rotations(observed.rotation_vectors(motion, x))
    axis = np.column_stack([x, 0 * x, 0 * x]) + observed.deflection(motion, x)
    local = axis[:, :, None] + np.einsum("fmij,maj->fmai", sections, rings)
    inertial = poses.position[:, None] + motion.outward(local.reshape(len(local), -1, 3))
    return DeformingSurface(f"beams/{name}", inertial, tube_faces(len(x), _CORNERS_AROUND), colour)


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
    zero_rates, zero_vectors = np.zeros_like(eta), np.zeros((len(eta), 3))
    return observed.Motion(
        motion.body,
        when.times,
        eta,
        zero_rates,
        zero_rates,
        poses.position,
        poses.rotation(),
        zero_vectors,
        zero_vectors,
        zero_vectors,
        zero_vectors,
    )


def _section_radii(shown: observed.Motion, x: Array, length: float, size: float) -> Array:
    """Radii (m,) in m of round sections with the same stiffness ratio, within visible limits.

    EI / EA = r^2 / 4.
    """
    sections = shown.shapes.sections(x)
    usual_radius = bar_radius(length, size)
    stretch, bend = np.asarray(sections.EA), np.maximum(sections.EI_y, sections.EI_z)
    with np.errstate(divide="ignore", invalid="ignore"):
        solid_radius = 2 * np.sqrt(bend / stretch)
    solid_radius = np.where(
        np.isfinite(solid_radius) & (solid_radius > 0), solid_radius, usual_radius
    )
    return np.clip(solid_radius, 0.4 * usual_radius, 2.5 * usual_radius)
