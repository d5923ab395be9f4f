"""Meaning of "auto" for a beam: frame, shape basis, number of shapes and quadrature.

Frame, per bending direction: tangent at the inboard section where the hinge, its drive or a heavy
rotor fixes the rotation; chord where the rotation is free, with or without a spring, because the
inertia of a tangent frame at a pinned section falls with the cube of the number of shapes; mean for
a free beam.

Basis: one that can carry the loads of the hinges.  Clamped-free, simply supported and free-free
shapes have no bending moment at a free, supported or free end.  Static end shapes therefore come
first at ends where a hinge transmits a moment, or that carry a tenth of the beam's mass or more.

Twist and axial shapes use the inboard section as frame, or the mean where the beam can spin freely.

Number of shapes per bending direction: three eigenfunctions (four in the mean frame), or all static
shapes and two more.  Twist and axial shapes are added where their stiffness and inertia are given
and their first frequency is below three times the highest one of bending: faster ones respond
quasi-statically and only reduce the step size.  A beam whose length is constrained by a loop
(`restraint`) gets at least the static axial shapes, without which it could not sag.  Twist is also
added where bending about the stiff axis can buckle the beam sideways within the range of its model.
A scene with planar motion (`planar_motion`) gets the shapes of that plane alone, unless its loads
can buckle a beam out of it.

Where the mass matrix of a stiffened beam would lose definiteness within the range of its model
(`mass_definiteness`), the same shapes are used in the mean frame, where they carry no momentum and
leave the rigid-body inertia unchanged.  A frame given in the scene is kept, and the mass is lumped
in points instead (quadrature).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..mass_definiteness import SLOPE
from .beam_data import BeamData, Frame
from .boundary_conditions import BoundaryConditions
from .shape_bases import (
    CLAMPED_FREE,
    FREE_FREE,
    GIVEN,
    SIMPLY_SUPPORTED,
    STATIC,
    Basis,
    static_count,
)
from .shape_functions import ExpressionShape
from .static_shapes import direction_stiffness

if TYPE_CHECKING:
    from mstmm.scene.tables.beam import Beam

BENDING = ("y", "z")
_FRAME_OF_BASIS = {CLAMPED_FREE: "tangent", SIMPLY_SUPPORTED: "chord", FREE_FREE: "mean"}
_BASIS_OF_FRAME = {"tangent": CLAMPED_FREE, "chord": SIMPLY_SUPPORTED, "mean": FREE_FREE}


@dataclass(frozen=True)
class DirectionChoice:
    """Frame, basis and number of shapes of one direction, and the reason for the frame."""

    direction: str
    frame: Frame
    basis: Basis
    count: int
    reason: str


def direction_choices(
    beam: Beam, data: BeamData, held: BoundaryConditions, idle: frozenset[str] = frozenset()
) -> tuple[DirectionChoice, ...]:
    """Choices for the directions with shapes; "auto" gives the directions in `idle` none."""
    frames = {d: _frame(beam, data, held, d) for d in BENDING}
    chosen = []
    for direction in BENDING:
        frame, why = frames[direction]
        basis = _basis(beam, data, held, direction, frame)
        count = 0 if _is_left_out(beam, direction, idle) else _count(beam, direction, frame, basis)
        if count:
            chosen.append(DirectionChoice(direction, frame, basis, count, why))
    highest_bending = max((_bending_frequency(data, c) for c in chosen), default=0.0)
    for direction in ("twist", "axial"):
        frame = _rod_frame(beam, held, direction, frames["y"][0])
        basis = _basis(beam, data, held, direction, frame)
        buckles = direction == "twist" and len(chosen) == 2 and _can_buckle_sideways(data)
        restrained = direction == "axial" and held.is_length_restrained
        count = _rod_count(beam, data, direction, basis, highest_bending, buckles, restrained)
        if count and not _is_left_out(beam, direction, idle):
            chosen.append(DirectionChoice(direction, frame, basis, count, ""))
    return tuple(chosen)


def can_use_mean_frame(beam: Beam, chosen: tuple[DirectionChoice, ...]) -> bool:
    """Whether the scene leaves the frame open and the mean frame is not chosen yet."""
    return beam.frame_kind == "auto" and any(c.frame.kind != "mean" for c in chosen)


def in_mean_frame(chosen: tuple[DirectionChoice, ...]) -> tuple[DirectionChoice, ...]:
    """The same choices, all with the mean frame."""
    why = "the mass matrix stays definite there"
    return tuple(replace(c, frame=Frame("mean"), reason=why if c.reason else "") for c in chosen)


def missing_static_shapes(
    chosen: tuple[DirectionChoice, ...], held: BoundaryConditions
) -> tuple[str, ...]:
    """Warnings about static shapes that are missing because the scene asks for fewer shapes."""
    messages = []
    if held.is_length_restrained and all(c.direction != "axial" for c in chosen):
        messages.append(
            "modes: no axial shapes, but both ends are fixed along the beam, which cannot sag "
            "without them; give axial = 1 or more"
        )
    for c in chosen:
        static = static_count(c.basis, c.direction)
        if c.count < static:
            messages.append(
                f"modes: {c.count} in direction {c.direction} cannot represent all forces and "
                f"moments at the ends, which takes {static} static shapes; give {static} or more"
            )
    return tuple(messages)


# --- frame ----------------------------------------------------------------------------------------


def _frame(
    beam: Beam, data: BeamData, held: BoundaryConditions, direction: str
) -> tuple[Frame, str]:
    kind, end_name = beam.frame_kind, beam.frame_end
    section = data.ends[end_name][0] if end_name else held.x
    if kind == "tangent":
        return Frame("tangent", section), ""
    if kind in ("chord", "mean"):
        return Frame(kind), ""
    natural_kind = _FRAME_OF_BASIS.get(beam.basis)
    if natural_kind is not None:
        x = held.x if natural_kind == "tangent" else 0.0
        return Frame(natural_kind, x), f"{beam.basis} shapes"
    if direction not in held.free_rotations:
        return Frame("tangent", held.x), f"{held.hinge_text} holds the section"
    if direction in held.heavy_rotor_rotations:
        return Frame("tangent", held.x), f"the rotor of {held.hinge_text} holds the section"
    if held.has_free_translation:
        return Frame("mean"), f"{held.hinge_text} leaves the beam free"
    return Frame("chord"), f"{held.hinge_text} leaves the section free to turn"


def _rod_frame(beam: Beam, held: BoundaryConditions, direction: str, bending: Frame) -> Frame:
    """Frame of twist or axial shapes: tangent at the inboard section, or mean if free there."""
    requested = beam.frame_kind != "auto" or beam.basis in _FRAME_OF_BASIS
    if bending.kind == "mean" or (requested and bending.kind == "tangent"):
        return bending
    free = direction in held.free_rotations - held.heavy_rotor_rotations - held.spring_rotations
    return Frame("mean") if free and not requested else Frame("tangent", held.x)


# --- basis ----------------------------------------------------------------------------------------


def _basis(
    beam: Beam, data: BeamData, held: BoundaryConditions, direction: str, frame: Frame
) -> Basis:
    given = getattr(beam.shapes, direction, ()) if beam.shapes is not None else ()
    if beam.basis == GIVEN:
        return Basis(GIVEN, given_shapes=tuple(ExpressionShape(e, data.length) for e in given))
    base = frame.x if frame.kind == "tangent" else held.x
    loaded = [end for end in held.ends if direction in end.moments or end.is_heavy]
    others = tuple(sorted({end.x for end in loaded} - {base}))
    if beam.basis == STATIC:
        return Basis(STATIC, base, others or _static_interfaces(data, held, base))
    if beam.basis in _FRAME_OF_BASIS:
        return Basis(beam.basis, base)
    if frame.kind == "chord":
        at_ends = all(x in (0.0, data.length) for x in others)
        if not at_ends:
            return Basis(STATIC, base, others)
        sprung = {held.x} if direction in held.spring_rotations else set()
        slopes = tuple(sorted({e.x for e in loaded if direction in e.moments} | sprung))
        return Basis(SIMPLY_SUPPORTED, base, slopes=slopes)
    if frame.kind == "mean" and (loaded or direction in held.spring_rotations):
        return Basis(STATIC, base, others or _static_interfaces(data, held, base))
    if loaded and others:
        return Basis(STATIC, base, others)
    return Basis(_BASIS_OF_FRAME[frame.kind], base)


def _static_interfaces(data: BeamData, held: BoundaryConditions, base: float) -> tuple[float, ...]:
    """Sections (m) of the other loaded ends, or of the far ends of the beam without any."""
    used = {end.x for end in held.ends} - {base}
    if not used:
        used = {0.0, data.length} - {base}
        if base in (0.0, data.length):
            used = {data.length - base}
    return tuple(sorted(used))


# --- number of shapes -----------------------------------------------------------------------------


def _is_left_out(beam: Beam, direction: str, idle: frozenset[str]) -> bool:
    return beam.modes is None and direction in idle


def _count(beam: Beam, direction: str, frame: Frame, basis: Basis) -> int:
    if beam.modes is not None:
        return int(getattr(beam.modes, direction))
    static = static_count(basis, direction)
    return static + 2 if static else (4 if frame.kind == "mean" else 3)


def _rod_count(
    beam: Beam, data: BeamData, direction: str, basis: Basis, highest_bending: float, buckles: bool,
    restrained: bool,
) -> int:  # fmt: skip
    if beam.modes is not None:
        return int(getattr(beam.modes, direction))
    lowest, static = _rod_frequency(data, direction), static_count(basis, direction)
    if lowest == 0.0 or (lowest > 3 * highest_bending and not (buckles or restrained)):
        return 0
    if direction == "axial" and static and 2 * lowest > 3 * highest_bending:
        return static  # fixed-interface modes have twice the frequency
    return static + (2 if buckles else 1)


def _can_buckle_sideways(data: BeamData) -> bool:
    """Whether bending about the stiff axis can buckle the beam sideways within its model.

    A cantilever of stiffness S, softer B and GJ in twist buckles by a moment m sqrt(B GJ) / L at
    slopes of s sqrt(B GJ) / S; s = 1.57 for a moment at its end, 2.01 for a force, 2.14 for a load
    spread along it (Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., sections 6.2, 6.3).
    """
    bending = np.sort([direction_stiffness(data, d) for d in BENDING], axis=0)
    slope = np.pi / 2 * np.sqrt(bending[0] * direction_stiffness(data, "twist")) / bending[1]
    return bool(slope.min() <= SLOPE)


def _rod_frequency(data: BeamData, direction: str) -> float:
    """First frequency (rad/s) pi/(2 L) sqrt(stiffness / inertia) of the means; 0 without either."""
    share = np.diff(data.breaks) / data.length
    inertia = data.inertia[0] if direction == "axial" else data.inertia[1] + data.inertia[2]
    stiffness = direction_stiffness(data, direction)
    if not (stiffness.all() and inertia.all()):
        return 0.0
    return float(np.pi / (2 * data.length) * np.sqrt(share @ stiffness / (share @ inertia)))


def _bending_frequency(data: BeamData, choice: DirectionChoice) -> float:
    """Estimate (count pi/L)^2 sqrt(EI / m) of the highest bending frequency, rad/s."""
    share = np.diff(data.breaks) / data.length
    stiffness = share @ direction_stiffness(data, choice.direction)
    wave = choice.count * np.pi / data.length
    return float(wave**2 * np.sqrt(stiffness / (share @ data.inertia[0])))
