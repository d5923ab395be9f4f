"""Animated modes: one selectable animation of a full cycle for each mode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ...integrate.c_loop import Statistics, Status
from ...integrate.settings import Settings
from ...result.result import Result
from ...result.scene3d.frame_times import FrameTimes
from ...result.scene3d.scene_builder import build_scene_graph
from ...result.scene3d.scene_graph import SceneGraph, Solid
from ...result.scene3d.solid_meshes import Surface, join_surfaces
from ...result.scene3d.view import SceneView
from ...run.trajectory import Trajectory
from .mode_shapes import Complex, amplitudes, eigenvalue_text

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Number of frames of a cycle, and its duration on screen, s.
_PICTURES, _LASTS = 41, 2.0
#: Largest displacement of a point, relative to the size of the scene; rotation of bodies that only
#: rotate about their own axis, rad; largest rotation, rad.
_PART, _TURNS, _MOST = 0.08, 0.5, 0.8
_GREY = (150, 155, 162)


def view(
    linear: LinearEquations,
    eigenvalues: Complex,
    shapes: NDArray[Any],
    which: Sequence[int],
    amplitude: float | None,
    title: str,
) -> SceneView:
    """Animated 3D view of modes; see `Modes.view`."""
    part = _PART if amplitude is None else amplitude
    phases = np.linspace(0.0, 360.0, _PICTURES)
    when = FrameTimes(np.arange(_PICTURES), phases, phases, 360.0 / _LASTS)
    rest = _reference_bodies(linear)
    parts = []
    for k in which:
        shape = shapes[:, k]
        moved = _amplitude(linear, shape, part) * np.exp(1j * np.deg2rad(phases))[:, None] * shape
        q = np.array([_close_loops(linear, linear.displaced_state(x)) for x in np.real(moved)])
        stage = build_scene_graph(_static_result(linear, q), title, when=when)
        stage = replace(stage, solids=(*stage.solids, rest), clock=("phase", "deg"))
        parts.append((f"mode {k + 1}, {eigenvalue_text(complex(eigenvalues[k]))}", stage))
    return SceneView(title, parts)


def _amplitude(linear: LinearEquations, shape: Array, part: float) -> float:
    """Factor of a shape for visible displacements and limited rotations."""
    both = np.stack([np.real(shape), np.imag(shape)], axis=1)
    largest = amplitudes(linear, both, part)
    turns = np.array([unit == "rad" for unit in linear.coordinate_units])
    most = np.abs(shape[turns]).max(initial=0.0)
    usual = float(largest[largest > 0].min(initial=np.inf))
    if not np.isfinite(usual):
        return _TURNS / most if most > 0 else 0.0
    return min(usual, _MOST / most) if most > 0 else usual


def _close_loops(linear: LinearEquations, q: Array) -> Array:
    """Nearest coordinates q (nq,) with closed loops; q itself if assembly fails."""
    closed = linear.model.loop_start
    if closed is None:
        return q
    try:
        return closed.assemble(q, np.zeros(linear.model.nu), (), ())[0]
    except SceneError:  # out of reach for the loops: draw the linear displacement
        return q


def _static_result(linear: LinearEquations, q: Array) -> Result:
    """Result of coordinates q (f, nq) as frames without speed, at the time of the state."""
    model, count, t = linear.model, len(q), linear.state.t
    memory = np.tile(model.looped.start_memory(), (count, 1))
    none: dict[str, Any] = {field.name: 0 for field in fields(Statistics)}
    return Result(model, Trajectory(
        np.full(count, t), q, np.zeros((count, model.nu)), memory, np.zeros(count),
        np.zeros(count, dtype=np.int64), Status.FINISHED, "", Settings(t, t), Statistics(**none),
    ))  # fmt: skip


def _reference_bodies(linear: LinearEquations) -> Solid:
    """Transparent bodies at the operating point."""
    still = _static_result(linear, linear.state.q[None])
    zero = np.zeros(1)
    stage = build_scene_graph(
        still, "", when=FrameTimes(np.zeros(1, dtype=np.int64), zero, zero, 1.0)
    )
    return Solid("rest", "bodies", join_surfaces(list(_surfaces(stage))), _GREY, 0.28)


def _surfaces(stage: SceneGraph) -> list[Surface]:
    surfaces = [Surface(bent.vertices[0], bent.faces) for bent in stage.deforming_surfaces]
    for solid in stage.solids:
        if solid.owner.startswith("bodies/") and not solid.hidden:
            surfaces.append(solid.surface.with_pose(*stage.poses[solid.owner].pose_at(0)))
    return surfaces
