"""Checks of flexible bodies: loads per length, spin, slenderness, frames and shape bases."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import hypot, sqrt
from typing import TYPE_CHECKING, NamedTuple

from ...numerics.rotations import Vector, dot, norm, rotate, unit_vector
from ...risk import Risk
from ..tables.beam import ROOT
from ..tables.hinge_frames import initial_motion_axes
from ..validators.scalars_and_vectors import Problem, split_reference
from .topology import inboard_hinges_by_body

if TYPE_CHECKING:
    from ..tables.beam import Beam, Section
    from ..tables.hinge import Hinge
    from ..tables.scene_tables import SceneTables


#: Length over height of the section below which shear and rotary inertia are no longer small.
MIN_SLENDERNESS = 10.0
#: Least component of a direction along the hinge axes for which it counts as free to rotate.
_MIN_FREE_COMPONENT = 0.7
_BEAM_AXIS: Vector = (1.0, 0.0, 0.0)
#: Direction of deflection -> axis of the rotation that goes with it.
_ROTATION_AXES: dict[str, Vector] = {"y": (0.0, 0.0, 1.0), "z": (0.0, 1.0, 0.0)}
_ALL_AXES: tuple[Vector, ...] = (_BEAM_AXIS, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_CLAMPED_FREE, _FREE_FREE, _SIMPLY_SUPPORTED = "clamped-free", "free-free", "simply-supported"


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


def spin_problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of beams that can spin about their axis but have no inertia about it."""
    carriers = {name for name, _ in _inboard_ends(scene)}
    released = {hinge.name for hinge in scene.hinge if hinge.is_released}
    released |= {event.hinge for event in scene.event if event.hinge is not None}
    inboard_hinges: dict[str, list[Hinge]] = {beam.name: [] for beam in scene.beam}
    for hinge in scene.hinge:
        inboard_hinges.get(hinge.outboard_body, []).append(hinge)
    for i, beam in enumerate(scene.beam):
        beam_hinges = inboard_hinges[beam.name]
        if any(section.polar_inertia_per_length is not None for section in beam.sections):
            continue
        rotor = any(any(hinge.law.inertia) for hinge in beam_hinges)
        if beam.name in carriers or rotor:
            continue
        if beam_hinges and all(
            _allows_spin(beam, hinge, hinge.name in released) for hinge in beam_hinges
        ):
            yield (
                ("beam", i, "polar_inertia_per_length"),
                f'missing; hinge "{beam_hinges[0].name}" allows the beam to spin about its axis, '
                "about which it has no inertia; expected rho I_p in kg m, more than 0, or "
                "rotary_inertia, or another hinge",
            )


def _allows_spin(beam: Beam, hinge: Hinge, released: bool) -> bool:
    """Whether a hinge allows a beam to spin about its axis without moving its mass."""
    is_free = _free_component(beam, hinge, _BEAM_AXIS, released) > 1 - 1e-9
    slides_while_turning = hinge.facts is not None and set(hinge.facts.turns) & set(
        hinge.facts.slides
    )
    return is_free and not slides_while_turning  # a screw also moves the mass along the axis


def _inboard_ends(scene: SceneTables) -> Iterator[tuple[str, str]]:
    """Inboard (body, end) of every hinge and chain."""
    for hinge in scene.hinge:
        yield split_reference(hinge.inboard)
    for chain in scene.chain:
        yield split_reference(chain.inboard)


def free_axes(hinge: Hinge, released: bool = False) -> tuple[Vector, ...]:
    """Unit axes of free rotation of a hinge, in the axes of the outboard end at q = 0.

    Driven coordinates count as fixed, except with `released`: then a fixed hinge has all axes.  A
    type that is not defined has none.
    """
    if released and hinge.is_weld:
        return _ALL_AXES
    drive = () if released else hinge.drive or ()
    rotation_axes = [rotation for _, rotation in initial_motion_axes(hinge) or ()]
    free = (
        a for k, a in enumerate(rotation_axes) if any(a) and (k >= len(drive) or drive[k] is None)
    )
    return tuple((x, y, z) for x, y, z in map(unit_vector, free))


def _free_component(beam: Beam, hinge: Hinge, direction: Vector, released: bool = False) -> float:
    """Component (0 to 1) of a direction of the beam along the free rotation axes of its hinge."""
    end_rotation = beam.ends[hinge.outboard_end].rotation
    return _projected_length(
        direction, [rotate(end_rotation, axis) for axis in free_axes(hinge, released)]
    )


def _projected_length(direction: Vector, axes: list[Vector]) -> float:
    """Length of the projection of a unit vector onto the span of others."""
    basis: list[Vector] = []
    for axis in axes:
        for basis_vector in basis:
            projection = dot(axis, basis_vector)
            axis = (axis[0] - projection * basis_vector[0], axis[1] - projection * basis_vector[1],
                    axis[2] - projection * basis_vector[2])  # fmt: skip
        if norm(axis) > 1e-9:
            x, y, z = unit_vector(axis)
            basis.append((x, y, z))
    return hypot(*(dot(direction, basis_vector) for basis_vector in basis))


# --- risks ----------------------------------------------------------------------------------------


def flexible_warnings(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about flexible bodies."""
    yield from short_beam_warnings(scene)
    for body in (*scene.beam, *scene.elastic):
        if max(body.damping.ratio) >= 1:
            table = "beam" if body in scene.beam else "elastic"
            ratio, name = max(body.damping.ratio), f'{table} "{body.name}"'
            yield Risk(
                "damping", name, f"{name}: damping: a ratio of {ratio:g} is critical or above",
                "write 0.01 for 1 percent", ratio, 1.0, invalidates=False, seen_before_run=True,
            )  # fmt: skip
    inboard_hinges = inboard_hinges_by_body(scene)
    for beam in scene.beam:
        if beam.model != "rigid" and beam.name in inboard_hinges:
            yield from _tangent_frame_warnings(beam, inboard_hinges[beam.name])
    for beam in scene.beam:
        if beam.model != "rigid":
            yield from _basis_warnings(scene, beam)
    tangent = {
        elastic.name
        for elastic in scene.elastic
        if elastic.frame == "tangent" and elastic.model != "rigid"
    }
    for hinge in inboard_hinges.values():
        if hinge.outboard_body in tangent and free_axes(hinge):
            yield _tangent_frame_warning(f'elastic "{hinge.outboard_body}"', hinge)


def short_beam_warnings(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about beams that are short for their height; welded lines count as one beam."""
    if not scene.beam:
        return
    lines = beam_lines(scene)
    beams_by_line: dict[str, list[Beam]] = {}
    for beam in scene.beam:
        has_shear = all(piece.shear_stiffness is not None for piece in beam.sections)
        if beam.model != "rigid" and not has_shear:
            beams_by_line.setdefault(lines[beam.name].first, []).append(beam)
    for beams in beams_by_line.values():
        name, length = beams[0].name, lines[beams[0].name].length
        heights = (_line_height(beams, k, direction) for k, direction in enumerate("zy"))
        height, direction, source = max(heights)
        if not 0 < length < MIN_SLENDERNESS * height:
            continue
        length_text = (
            "its length is" if length == beams[0].length else "its line of welded beams is"
        )
        yield Risk(
            "short-beam", f'beam "{name}"',
            f'beam "{name}": {length_text} {length / height:.2g} times the height of the '
            f"section along {direction} ({height:.3g} m from {source}), less than "
            f"{MIN_SLENDERNESS:g}: shear deformation, which Euler-Bernoulli beams neglect, is not "
            "small", "give shear_stiffness and rotary_inertia, or use an elastic body from a mesh",
            length / height, MIN_SLENDERNESS, seen_before_run=True,
        )  # fmt: skip


def _line_height(beams: Sequence[Beam], k: int, direction: str) -> tuple[float, str, str]:
    """Height (m) of the sections of beams in line, as if rectangular, with direction and source.

    It is the root of the mean of its square, each section weighted by how far it bends under the
    same moment: a short thick piece bends and shears little.
    """
    total, square, sources = 0.0, 0.0, list[str]()
    for beam in beams:
        if not _has_bending_shapes(beam, direction):
            continue
        for section in beam.sections:
            section_square, source = _square_height(section, k)
            if source and section.bending_stiffness is not None:
                compliance = (section.to - section.from_) / section.bending_stiffness[k]
                total, square = total + compliance, square + compliance * section_square
                sources.append(source)
    return (sqrt(square / total), direction, sources[0]) if sources else (0.0, direction, "")


def _square_height(section: Section, k: int) -> tuple[float, str]:
    """Square (m^2) of the height as if rectangular, and source keys; (0, "") if not known.

    The height is sqrt(12) times the radius of gyration, from rotary inertia or else from E I / E A.
    """
    rotary_inertia, bending_stiffness = section.rotary_inertia, section.bending_stiffness
    if rotary_inertia is not None and section.mass_per_length:
        square = 12 * rotary_inertia[k] / section.mass_per_length
        return square, "rotary_inertia and mass_per_length"
    if rotary_inertia is None and bending_stiffness is not None and section.axial_stiffness:
        source = "bending_stiffness and axial_stiffness"
        return 12 * bending_stiffness[k] / section.axial_stiffness, source
    return 0.0, ""


def _has_bending_shapes(beam: Beam, direction: str) -> bool:
    return beam.modes is None or bool(getattr(beam.modes, direction))


def _tangent_frame_warnings(beam: Beam, hinge: Hinge) -> Iterator[Risk]:
    """Warning about a tangent frame at an end that its hinge leaves free to rotate."""
    end = hinge.outboard_end
    if beam.frame_kind != "tangent" or beam.frame_end not in ("", end) or beam.quadrature:
        return
    if any(
        _has_bending_shapes(beam, direction)
        and _free_component(beam, hinge, axis) > _MIN_FREE_COMPONENT
        for direction, axis in _ROTATION_AXES.items()
    ):
        yield _tangent_frame_warning(f'beam "{beam.name}"', hinge)


def _tangent_frame_warning(body: str, hinge: Hinge) -> Risk:
    return Risk(
        "frame", body,
        f'{body}: frame: a tangent frame at "{hinge.outboard_end}", which hinge "{hinge.name}" '
        "leaves free to rotate, has little inertia there: more shapes need smaller steps",
        'use frame = "auto"', invalidates=False, seen_before_run=True,
    )  # fmt: skip


def _basis_warnings(scene: SceneTables, beam: Beam) -> Iterator[Risk]:
    """Warning about a basis whose shapes have no bending moment where a hinge carries one."""
    if beam.basis not in (_CLAMPED_FREE, _FREE_FREE, _SIMPLY_SUPPORTED):
        return
    tolerance = 1e-9 * beam.length
    for hinge in scene.hinge:
        for reference in (hinge.inboard, hinge.outboard):
            name, end = split_reference(reference)
            if name != beam.name:
                continue
            x = beam.end_x(end)
            is_root = x <= tolerance and beam.basis != _CLAMPED_FREE
            if (is_root or x >= beam.length - tolerance) and _carries_moment(
                beam, hinge, end, reference == hinge.outboard
            ):
                yield Risk(
                    "basis", f'beam "{beam.name}"',
                    f'beam "{beam.name}": basis: {beam.basis} shapes have no bending moment at '
                    f'"{end}", but hinge "{hinge.name}" carries one there, so that they converge '
                    "slowly", 'use basis = "static+fixed-interface" or "auto"', invalidates=False,
                    seen_before_run=True,
                )  # fmt: skip
                return


def _carries_moment(beam: Beam, hinge: Hinge, at: str, outboard: bool) -> bool:
    """Whether a hinge constrains the rotation of the section in a plane in which the beam bends."""
    if hinge.facts is None:
        return False
    end_rotation = beam.ends[at].rotation
    to_outboard_axes = (lambda v: v) if outboard else (lambda v: rotate(hinge.rotation, v))
    axes = [rotate(end_rotation, to_outboard_axes(axis)) for axis in free_axes(hinge)]
    has_spring = any(hinge.law.stiffness)
    return any(
        _has_bending_shapes(beam, direction)
        and (has_spring or _projected_length(axis, axes) < _MIN_FREE_COMPONENT)
        for direction, axis in _ROTATION_AXES.items()
    )


# --- straight lines of welded beams ---------------------------------------------------------------


#: Least cosine of the angle between the axes of two beams in line.
_MIN_AXIS_COSINE = 0.999


class BeamLine(NamedTuple):
    """Straight line of welded beams: name of its first beam, and length in m."""

    first: str
    length: float


def beam_lines(scene: SceneTables) -> dict[str, BeamLine]:
    """Straight line of welded beams of each beam; a single beam forms a line.

    Two beams are in line where a fixed hinge connects their extreme ends and their axes agree.
    """
    beams = {beam.name: beam for beam in scene.beam}
    previous_beams = {name: name for name in beams}

    def first_beam(name: str) -> str:
        while previous_beams[name] != name:
            previous_beams[name] = previous_beams[previous_beams[name]]
            name = previous_beams[name]
        return name

    released = {event.hinge for event in scene.event if event.hinge is not None}
    for hinge in scene.hinge:
        if hinge.is_weld and not hinge.is_released and hinge.name not in released:
            pair = _aligned_beams(hinge, beams)
            if pair is not None:
                previous_beams[first_beam(pair[1])] = first_beam(pair[0])
    lengths: dict[str, float] = {}
    for name, beam in beams.items():
        lengths[first_beam(name)] = lengths.get(first_beam(name), 0.0) + beam.length
    return {name: BeamLine(first_beam(name), lengths[first_beam(name)]) for name in beams}


def _aligned_beams(hinge: Hinge, beams: dict[str, Beam]) -> tuple[str, str] | None:
    """Beams that a fixed hinge joins in a straight line, (inboard, outboard); None for others."""
    (inboard, inboard_end), (outboard, outboard_end) = (
        split_reference(hinge.inboard), split_reference(hinge.outboard)
    )  # fmt: skip
    if inboard not in beams or outboard not in beams:
        return None
    sides = _end_side(beams[inboard], inboard_end), _end_side(beams[outboard], outboard_end)
    if 0 in sides:
        return None
    # The axis of the outer beam in the axes of its end is the first row of their rotation.
    outboard_direction = beams[outboard].ends[outboard_end or ROOT].rotation[0]
    inboard_rotation = beams[inboard].ends[inboard_end or ROOT].rotation
    direction = rotate(inboard_rotation, rotate(hinge.rotation, outboard_direction))
    sign = -1.0 if sides[0] == sides[1] else 1.0  # axes are opposite where two tips meet
    return (inboard, outboard) if sign * direction[0] > _MIN_AXIS_COSINE else None


def _end_side(beam: Beam, end: str) -> int:
    """Location of an end: -1 at x = 0, 1 at the tip, 0 between."""
    x = beam.end_x(end)
    tolerance = 1e-9 * beam.length
    return -1 if x <= tolerance else 1 if x >= beam.length - tolerance else 0
