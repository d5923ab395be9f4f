"""Checks of flexible bodies: loads per length, spin, slenderness, frames and shape bases."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot, sqrt
from typing import TYPE_CHECKING

from ...numbers.rotations import Vector, apply, dot, norm, unit
from ...risk import Risk
from ..rules.values import Location, split
from ..tables.hinge_frames import start_motion
from .topology import holders
from .welded import lines as lines_of

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.beam import Beam
    from ..tables.hinge import Hinge

Problem = tuple[Location, str]

#: Length over height of the section below which shear and rotary inertia are no longer small.
SLENDER = 10.0
#: Least component of a direction along the hinge axes for which it counts as free to rotate.
_MOSTLY = 0.7
_ALONG: Vector = (1.0, 0.0, 0.0)
#: Direction of deflection -> axis of the rotation that goes with it.
_TURNS: dict[str, Vector] = {"y": (0.0, 0.0, 1.0), "z": (0.0, 1.0, 0.0)}
_AXES: tuple[Vector, ...] = (_ALONG, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_CF, _FF, _SS = "clamped-free", "free-free", "simply-supported"


# --- loads per length -----------------------------------------------------------------------------


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of flexible bodies with other elements of the scene."""
    beams = {beam.name: beam for beam in scene.beam}
    for i, load in enumerate(scene.load):
        if load.force_per_length is None:
            continue
        beam = beams.get(load.on)
        if beam is None:
            if scene.skeleton.bodies.find(load.on) is not None:
                message = f'"{load.on}" is no beam; force_per_length acts only on beams; '
                yield ("load", i, "on"), message + "use force at one of its ends"
            continue
        if load.span is not None and load.span[1] > beam.length * (1 + 1e-9):
            yield (
                ("load", i, "span"),
                f'expected a part of the beam "{beam.name}", 0 to {beam.length:g} m, found '
                f"[{load.span[0]:g}, {load.span[1]:g}]",
            )
        if load.name in beam.ends:
            yield (
                ("load", i, "name"),
                f'"{load.name}" is also an end of the beam "{beam.name}"; rename the load',
            )


# --- free rotation axes of hinges -----------------------------------------------------------------


def spins(scene: SceneTables) -> Iterator[Problem]:
    """Problems of beams that can spin about their axis but have no inertia about it."""
    carriers = {name for name, _ in _carried(scene)}
    released = {hinge.name for hinge in scene.hinge if hinge.lets_go}
    released |= {event.hinge for event in scene.event if event.hinge is not None}
    holding: dict[str, list[Hinge]] = {beam.name: [] for beam in scene.beam}
    for hinge in scene.hinge:
        holding.get(hinge.outboard_body, []).append(hinge)
    for i, beam in enumerate(scene.beam):
        held = holding[beam.name]
        if any(piece.polar_inertia_per_length is not None for piece in beam.sections):
            continue
        rotor = any(any(hinge.law.inertia) for hinge in held)
        if beam.name in carriers or rotor:
            continue
        if held and all(_spins(beam, hinge, hinge.name in released) for hinge in held):
            yield (
                ("beam", i, "polar_inertia_per_length"),
                f'missing; hinge "{held[0].name}" allows the beam to spin about its axis, about '
                "which it has no inertia; expected rho I_p in kg m, more than 0, or "
                "rotary_inertia, or another hinge",
            )


def _spins(beam: Beam, hinge: Hinge, released: bool) -> bool:
    """Whether a hinge allows a beam to spin about its axis without moving its mass."""
    free = _share(beam, hinge, _ALONG, released) > 1 - 1e-9
    slid = hinge.facts is not None and set(hinge.facts.turns) & set(hinge.facts.slides)
    return free and not slid  # a screw also moves the mass along the axis


def _carried(scene: SceneTables) -> Iterator[tuple[str, str]]:
    """Inboard (body, end) of every hinge and chain."""
    for hinge in scene.hinge:
        yield split(hinge.inboard)
    for chain in scene.chain:
        yield split(chain.inboard)


def free_axes(hinge: Hinge, released: bool = False) -> tuple[Vector, ...]:
    """Unit axes of free rotation of a hinge, in the axes of the outboard end at q = 0.

    Driven coordinates count as fixed, except with `released`: then a fixed hinge has all axes.  A
    type that is not defined has none.
    """
    if released and hinge.is_weld:
        return _AXES
    drive = () if released else hinge.drive or ()
    turned = [rotation for _, rotation in start_motion(hinge) or ()]
    free = (a for k, a in enumerate(turned) if any(a) and (k >= len(drive) or drive[k] is None))
    return tuple(_unit(axis) for axis in free)


def _unit(axis: Vector) -> Vector:
    x, y, z = axis if abs(norm(axis) - 1) <= 1e-15 else unit(axis)
    return (x, y, z)


def _share(beam: Beam, hinge: Hinge, direction: Vector, released: bool = False) -> float:
    """Component (0 to 1) of a direction of the beam along the free rotation axes of its hinge."""
    turn = beam.ends[hinge.outboard_end].rotation
    return _within(direction, [apply(turn, axis) for axis in free_axes(hinge, released)])


def _within(direction: Vector, axes: list[Vector]) -> float:
    """Length of the projection of a unit vector onto the span of others."""
    basis: list[Vector] = []
    for axis in axes:
        for known in basis:
            along = dot(axis, known)
            axis = (axis[0] - along * known[0], axis[1] - along * known[1],
                    axis[2] - along * known[2])  # fmt: skip
        if norm(axis) > 1e-9:
            x, y, z = unit(axis)
            basis.append((x, y, z))
    return hypot(*(dot(direction, known) for known in basis))


# --- risks ----------------------------------------------------------------------------------------


def risks(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about flexible bodies."""
    yield from short_beams(scene)
    for body in (*scene.beam, *scene.elastic):
        if max(body.damping.ratio) >= 1:
            ratio, name = max(body.damping.ratio), _called(scene, body.name)
            yield Risk(
                "damping", name, f"{name}: damping: a ratio of {ratio:g} is critical or above",
                "write 0.01 for 1 percent", ratio, 1.0, doubt=False, before=True,
            )  # fmt: skip
    held = holders(scene)
    for beam in scene.beam:
        if beam.model != "rigid" and beam.name in held:
            yield from _loose_frame(beam, held[beam.name])
    for beam in scene.beam:
        if beam.model != "rigid":
            yield from _weak_basis(scene, beam)
    tangent = {e.name for e in scene.elastic if e.frame == "tangent" and e.model != "rigid"}
    for hinge in held.values():
        if hinge.outboard_body in tangent and free_axes(hinge):
            yield _loose(f'elastic "{hinge.outboard_body}"', hinge)


def _called(scene: SceneTables, name: str) -> str:
    word = "beam" if any(beam.name == name for beam in scene.beam) else "elastic"
    return f'{word} "{name}"'


def short_beams(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about beams that are short for their height; welded lines count as one beam."""
    if not scene.beam:
        return
    lines, said = lines_of(scene), set[str]()
    for beam in scene.beam:
        height, direction, source = max(_heights(beam), default=(0.0, "", ""))
        line = lines[beam.name]
        if not 0 < line.length < SLENDER * height or line.first in said or beam.model == "rigid":
            continue
        said.add(line.first)
        whole = "its length is" if line.length == beam.length else "its line of welded beams is"
        yield Risk(
            "short-beam", f'beam "{beam.name}"',
            f'beam "{beam.name}": {whole} {line.length / height:.2g} times the height of the '
            f"section along {direction} ({height:.3g} m from {source}), less than {SLENDER:g}: "
            "shear deformation, which Euler-Bernoulli beams neglect, is not small",
            "use an elastic body from a mesh", line.length / height, SLENDER, before=True,
        )  # fmt: skip


def _heights(beam: Beam) -> Iterator[tuple[float, str, str]]:
    """Heights of the sections as if rectangular: (height in m, direction, source keys).

    The height is sqrt(12) times the radius of gyration, from rotary inertia or else from E I / E A.
    """
    for piece in beam.sections:
        rotary, bending = piece.rotary_inertia, piece.bending_stiffness
        for k, direction in enumerate(("z", "y")):
            if not _bends(beam, direction):
                continue
            if rotary is not None and piece.mass_per_length:
                source = "rotary_inertia and mass_per_length"
                yield sqrt(12 * rotary[k] / piece.mass_per_length), direction, source
            elif rotary is None and bending is not None and piece.axial_stiffness:
                source = "bending_stiffness and axial_stiffness"
                yield sqrt(12 * bending[k] / piece.axial_stiffness), direction, source


def _bends(beam: Beam, direction: str) -> bool:
    return beam.modes is None or bool(getattr(beam.modes, direction))


def _loose_frame(beam: Beam, hinge: Hinge) -> Iterator[Risk]:
    """Warning about a tangent frame at an end that its hinge leaves free to rotate."""
    at = hinge.outboard_end
    if beam.frame_kind != "tangent" or beam.frame_end not in ("", at) or beam.quadrature:
        return
    for direction, axis in _TURNS.items():
        if _bends(beam, direction) and _share(beam, hinge, axis) > _MOSTLY:
            yield _loose(f'beam "{beam.name}"', hinge)
            return


def _loose(body: str, hinge: Hinge) -> Risk:
    return Risk(
        "frame", body,
        f'{body}: frame: a tangent frame at "{hinge.outboard_end}", which hinge "{hinge.name}" '
        "leaves free to rotate, has little inertia there: more shapes need smaller steps",
        'use frame = "auto"', doubt=False, before=True,
    )  # fmt: skip


def _weak_basis(scene: SceneTables, beam: Beam) -> Iterator[Risk]:
    """Warning about a basis whose shapes have no bending moment where a hinge carries one."""
    if beam.basis not in (_CF, _FF, _SS):
        return
    slack = 1e-9 * beam.length
    for hinge in scene.hinge:
        for reference in (hinge.inboard, hinge.outboard):
            name, at = split(reference)
            if name != beam.name:
                continue
            x = beam.end_x(at)
            moment_free = x >= beam.length - slack or (x <= slack and beam.basis != _CF)
            if moment_free and _carries_moment(beam, hinge, at, reference == hinge.outboard):
                yield Risk(
                    "basis", f'beam "{beam.name}"',
                    f'beam "{beam.name}": basis: {beam.basis} shapes have no bending moment at '
                    f'"{at}", but hinge "{hinge.name}" carries one there, so that they converge '
                    "slowly", 'use basis = "static+fixed-interface" or "auto"', doubt=False,
                    before=True,
                )  # fmt: skip
                return


def _carries_moment(beam: Beam, hinge: Hinge, at: str, outboard: bool) -> bool:
    """Whether a hinge constrains the rotation of the section in a plane in which the beam bends."""
    if hinge.facts is None:
        return False
    turn = beam.ends[at].rotation
    back = (lambda v: v) if outboard else (lambda v: apply(hinge.rotation, v))
    axes = [apply(turn, back(axis)) for axis in free_axes(hinge)]
    sprung = any(hinge.law.stiffness)
    return any(
        _bends(beam, direction) and (sprung or _within(axis, axes) < _MOSTLY)
        for direction, axis in _TURNS.items()
    )
