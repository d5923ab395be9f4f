"""What `"auto"` stands for: frame, basis, number of shapes and quadrature of a beam.

Frame, per bending direction: tangent at the held section where the hinge holds the rotation (or
drives it, or a heavy rotor does); chord where it leaves the rotation free, a spring or not, for a
frame tied to a pinned section is left with an inertia there that falls with the cube of the number
of shapes; mean where nothing holds the beam at all.

Basis: one that can carry the loads of the hinges.  Clamped-free, simply supported and free-free
shapes have no bending moment at a free, supported or free end, so that static end shapes come first
where a hinge carries a moment there, or a mass of a tenth of the beam's or more hangs.

Twist and tension follow the section that is held, or the mean where the hinge lets the beam spin.

Number of shapes per bending direction: three eigenfunctions (four in the mean frame), or all static
shapes and two more.  Twist and axial shapes join where their stiffness and inertia are given and
their first frequency is below three times the highest of bending: beyond, they follow the loads at
once and cost only small steps.  A beam whose length the rest of a loop holds (`restraint`) has the
static axial shapes at least, without which it could not sag.  Twist also joins where bending about
the stiff axis can buckle the beam sideways before it leaves the range of its model.  A scene that
stays in a plane (`planar`) gets the shapes of that plane alone, unless its loads can buckle a beam
out of it.

Where the mass matrix of a stiffened beam would not stay definite over the slopes that the model is
made for (`definiteness`), the same shapes are taken in the mean frame, in which the shapes carry no
momentum and leave the inertia where it is.  A frame that is asked for is kept, and the mass goes
into points instead (quadrature).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..mass_definiteness import SLOPE
from .beam_data import BeamData
from .boundary_conditions import BoundaryConditions
from .expression_shapes import ExpressionShape
from .frame_location import Frame
from .shape_bases import (
    CLAMPED_FREE,
    FREE_FREE,
    GIVEN,
    SIMPLY_SUPPORTED,
    STATIC,
    Basis,
    static_count,
)
from .static_shapes import stiffness_of

if TYPE_CHECKING:
    from mstmm.scene.tables.beam import Beam

BENDING = ("y", "z")
_NATURAL = {CLAMPED_FREE: "tangent", SIMPLY_SUPPORTED: "chord", FREE_FREE: "mean"}
_OF_FRAME = {"tangent": CLAMPED_FREE, "chord": SIMPLY_SUPPORTED, "mean": FREE_FREE}


@dataclass(frozen=True)
class DirectionChoice:
    """Frame, basis and number of shapes of one direction, and why."""

    direction: str
    frame: Frame
    basis: Basis
    count: int
    why: str


def choices(
    beam: Beam, data: BeamData, held: BoundaryConditions, idle: frozenset[str] = frozenset()
) -> tuple[DirectionChoice, ...]:
    """One choice per direction that has shapes; "auto" gives the directions in `idle` none."""
    frames = {d: _frame(beam, data, held, d) for d in BENDING}
    made = []
    for direction in BENDING:
        frame, why = frames[direction]
        basis = _basis(beam, data, held, direction, frame)
        count = 0 if _left_out(beam, direction, idle) else _count(beam, direction, frame, basis)
        if count:
            made.append(DirectionChoice(direction, frame, basis, count, why))
    highest = max((_frequency(data, c) for c in made), default=0.0)
    for direction in ("twist", "axial"):
        frame = _rod_frame(beam, held, direction, frames["y"][0])
        basis = _basis(beam, data, held, direction, frame)
        tips = direction == "twist" and len(made) == 2 and _tips(data)
        pulled = direction == "axial" and held.restrained
        count = _rod_count(beam, data, direction, basis, highest, tips, pulled)
        if count and not _left_out(beam, direction, idle):
            made.append(DirectionChoice(direction, frame, basis, count, ""))
    return tuple(made)


def may_change_frame(beam: Beam, chosen: tuple[DirectionChoice, ...]) -> bool:
    """Whether no frame was asked for, and there is another one to take."""
    return beam.frame_kind == "auto" and any(c.frame.kind != "mean" for c in chosen)


def in_the_mean(chosen: tuple[DirectionChoice, ...]) -> tuple[DirectionChoice, ...]:
    """The same shapes, all counted from the mean of the mass."""
    why = "the mass matrix stays definite there"
    return tuple(replace(c, frame=Frame("mean"), why=why if c.why else "") for c in chosen)


def warnings(chosen: tuple[DirectionChoice, ...], held: BoundaryConditions) -> tuple[str, ...]:
    """Static shapes that are missing because fewer shapes were asked for."""
    found = []
    if held.restrained and all(c.direction != "axial" for c in chosen):
        found.append(
            "modes: no axial shapes, but both ends are held along the beam, which cannot sag "
            "without them; give axial = 1 or more"
        )
    for c in chosen:
        static = static_count(c.basis, c.direction)
        if c.count < static:
            found.append(
                f"modes: {c.count} in direction {c.direction} cannot carry all forces and moments "
                f"at the ends, which takes {static} static shapes; give {static} or more"
            )
    return tuple(found)


# --- frame ----------------------------------------------------------------------------------------


def _frame(
    beam: Beam, data: BeamData, held: BoundaryConditions, direction: str
) -> tuple[Frame, str]:
    kind, at = beam.frame_kind, beam.frame_end
    section = data.ends[at][0] if at else held.x
    if kind == "tangent":
        return Frame("tangent", section), "as asked for"
    if kind in ("chord", "mean"):
        return Frame(kind), "as asked for"
    natural = _NATURAL.get(beam.basis)
    if natural is not None:
        return Frame(natural, held.x if natural == "tangent" else 0.0), f"{beam.basis} shapes"
    if direction not in held.turns:
        return Frame("tangent", held.x), f"{held.said} holds the section"
    if direction in held.heavy_rotor:
        return Frame("tangent", held.x), f"the rotor of {held.said} holds the section"
    if held.moves:
        return Frame("mean"), f"{held.said} leaves the beam free"
    return Frame("chord"), f"{held.said} leaves the section free to turn"


def _rod_frame(beam: Beam, held: BoundaryConditions, direction: str, bending: Frame) -> Frame:
    """Twist and tension follow the held section; where nothing holds them, the mean."""
    asked = beam.frame_kind != "auto" or beam.basis in _NATURAL
    if bending.kind == "mean" or (asked and bending.kind == "tangent"):
        return bending
    free = direction in held.turns - held.heavy_rotor - held.sprung
    return Frame("mean") if free and not asked else Frame("tangent", held.x)


# --- basis ----------------------------------------------------------------------------------------


def _basis(
    beam: Beam, data: BeamData, held: BoundaryConditions, direction: str, frame: Frame
) -> Basis:
    given = getattr(beam.shapes, direction, ()) if beam.shapes is not None else ()
    if beam.basis == GIVEN:
        return Basis(GIVEN, given=tuple(ExpressionShape(e, data.length) for e in given))
    base = frame.x if frame.kind == "tangent" else held.x
    loaded = [end for end in held.ends if direction in end.moments or end.heavy]
    others = tuple(sorted({end.x for end in loaded} - {base}))
    if beam.basis == STATIC:
        return Basis(STATIC, base, others or _all_others(data, held, base))
    if beam.basis in _NATURAL:
        return Basis(beam.basis, base)
    if frame.kind == "chord":
        at_ends = all(x in (0.0, data.length) for x in others)
        if not at_ends:
            return Basis(STATIC, base, others)
        sprung = {held.x} if direction in held.sprung else set()
        slopes = tuple(sorted({e.x for e in loaded if direction in e.moments} | sprung))
        return Basis(SIMPLY_SUPPORTED, base, slopes=slopes)
    if frame.kind == "mean" and (loaded or direction in held.sprung):
        return Basis(STATIC, base, others or _all_others(data, held, base))
    if loaded and others:
        return Basis(STATIC, base, others)
    return Basis(_OF_FRAME[frame.kind], base)


def _all_others(data: BeamData, held: BoundaryConditions, base: float) -> tuple[float, ...]:
    """Every end that something acts at, else the far ends."""
    used = {end.x for end in held.ends} - {base}
    if not used:
        used = {0.0, data.length} - {base}
        if base in (0.0, data.length):
            used = {data.length - base}
    return tuple(sorted(used))


# --- number of shapes -----------------------------------------------------------------------------


def _left_out(beam: Beam, direction: str, idle: frozenset[str]) -> bool:
    return beam.modes is None and direction in idle


def _count(beam: Beam, direction: str, frame: Frame, basis: Basis) -> int:
    if beam.modes is not None:
        return int(getattr(beam.modes, direction))
    static = static_count(basis, direction)
    return static + 2 if static else (4 if frame.kind == "mean" else 3)


def _rod_count(
    beam: Beam, data: BeamData, direction: str, basis: Basis, highest: float, tips: bool,
    pulled: bool,
) -> int:  # fmt: skip
    if beam.modes is not None:
        return int(getattr(beam.modes, direction))
    first, static = _rod_frequency(data, direction), static_count(basis, direction)
    if first == 0.0 or (first > 3 * highest and not (tips or pulled)):
        return 0
    if direction == "axial" and static and 2 * first > 3 * highest:
        return static  # vibrations with the ends held are twice as fast
    return static + (2 if tips else 1)


def _tips(data: BeamData) -> bool:
    """Whether moments that bend the beam about its stiff axis to slopes within its model can buckle
    it sideways, with twist.

    A cantilever of stiffness S, softer B and GJ in twist buckles by a moment m sqrt(B GJ) / L at
    slopes of s sqrt(B GJ) / S; s = 1.57 for a moment at its end, 2.01 for a force, 2.14 for a load
    spread along it (Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., sections 6.2, 6.3).
    """
    bending = np.sort([stiffness_of(data, d) for d in BENDING], axis=0)
    slope = np.pi / 2 * np.sqrt(bending[0] * stiffness_of(data, "twist")) / bending[1]
    return bool(slope.min() <= SLOPE)


def _rod_frequency(data: BeamData, direction: str) -> float:
    """pi/(2 L) sqrt(stiffness / inertia) of the means over the beam; 0 without either."""
    share = np.diff(data.breaks) / data.length
    inertia = data.inertia[0] if direction == "axial" else data.inertia[1] + data.inertia[2]
    stiffness = stiffness_of(data, direction)
    if not (stiffness.all() and inertia.all()):
        return 0.0
    return float(np.pi / (2 * data.length) * np.sqrt(share @ stiffness / (share @ inertia)))


def _frequency(data: BeamData, choice: DirectionChoice) -> float:
    """(count pi/L)^2 sqrt(EI / m): about the highest frequency of bending."""
    share = np.diff(data.breaks) / data.length
    stiffness = share @ stiffness_of(data, choice.direction)
    wave = choice.count * np.pi / data.length
    return float(wave**2 * np.sqrt(stiffness / (share @ data.inertia[0])))
