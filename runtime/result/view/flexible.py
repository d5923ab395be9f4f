"""Beams as bent tubes, elastic bodies by their meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array

from ..flexible import motion as observed
from .bodies import thickness
from .moments import Moments
from .solids import Colour, ellipsoid, tube_faces
from .stage import Bent, Poses

if TYPE_CHECKING:
    from ..record import Record

#: Sections of a tube and corners of each.
_STATIONS, _AROUND = 25, 8
#: Nodes of a body without a mesh that are drawn.
_DOTS = 400


def tube(run: Record, name: str, when: Moments, poses: Poses, size: float, colour: Colour) -> Bent:
    """A beam as it bends and twists, deflections as they are."""
    shown = motion_at(run, name, when, poses)
    length = float(shown.shapes.length)
    x = np.linspace(0.0, length, _STATIONS)
    radius = np.pad(_radius(shown, x, length, size), 1, mode="edge")
    radius = np.pad(radius, 1)  # discs close its ends, whose rims stay sharp
    x = np.pad(x, 2, mode="edge")
    angles = 2 * np.pi * np.arange(_AROUND) / _AROUND
    circle = np.stack([np.zeros(_AROUND), np.cos(angles), np.sin(angles)], axis=1)
    rings = radius[:, None, None] * circle
    sections = observed.section_rotations(observed.turns(shown, x))
    axis = np.column_stack([x, 0 * x, 0 * x]) + observed.deflection(shown, x)
    local = axis[:, :, None] + np.einsum("fmij,maj->fmai", sections, rings)
    inertial = poses.position[:, None] + shown.outward(local.reshape(len(local), -1, 3))
    return Bent(f"beams/{name}", inertial, tube_faces(len(x), _AROUND), colour)


def outside(run: Record, name: str, when: Moments, poses: Poses, r: float, colour: Colour) -> Bent:
    """An elastic body by the nodes that it was made of, moved by its shapes to first order: its
    outside where a mesh is known, else every node as a dot of radius r (m)."""
    shown = motion_at(run, name, when, poses)
    skin = shown.body.skin
    assert skin is not None
    local = skin.nodes + np.einsum("cNn,fn->fNc", skin.phi, shown.eta)
    faces = skin.faces
    if not len(faces):
        some = slice(None, None, -(-local.shape[1] // _DOTS))
        dot = ellipsoid((r, r, r), 4)
        local = local[:, some, None] + dot.vertices
        starts = len(dot.vertices) * np.arange(local.shape[1])
        faces = (starts[:, None, None] + dot.faces).reshape(-1, 3)
    inertial = poses.position[:, None] + shown.outward(local.reshape(len(local), -1, 3))
    return Bent(f"elastic/{name}", inertial, faces, colour)


def motion_at(run: Record, name: str, when: Moments, poses: Poses) -> observed.Motion:
    """The body's motion at the moments; rates that a picture has no need of are zero."""
    motion = run._flexible.motion(name).some(when.kept)
    eta = when.smooth(motion.eta, motion.etad)
    none, still = np.zeros_like(eta), np.zeros((len(eta), 3))
    return observed.Motion(
        motion.body, when.times, eta, none, none, poses.position, poses.rotation(), still, still,
        still, still,
    )  # fmt: skip


def _radius(shown: observed.Motion, x: Array, length: float, size: float) -> Array:
    """(m,) m, of the round section with the same ratio of stiffnesses, within what can be seen:
    EI / EA = r^2 / 4."""
    sections = shown.shapes.sections(x)
    usual = thickness(length, size)
    stretch, bend = np.asarray(sections.EA), np.maximum(sections.EI_y, sections.EI_z)
    with np.errstate(divide="ignore", invalid="ignore"):
        solid = 2 * np.sqrt(bend / stretch)
    solid = np.where(np.isfinite(solid) & (solid > 0), solid, usual)
    return np.clip(solid, 0.4 * usual, 2.5 * usual)
