"""Numbers of hinge laws, loads, and force elements between two ends."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

from mstmm.expression.expression import Expression, number
from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.numerics.rotations import Matrix, Vector, product, rotate, to_matrix, transpose
from mstmm.scene import Bushing, Hinge, LawEntry, Scene, Spring
from mstmm.scene.checks.topology import BodyRow, Topology
from mstmm.scene.tables.hinge_frames import twist_axes

from ..kernels.prebuilt_kernels import declared_numbers
from .coordinate_layout import HingeSlots, Layout
from .expression_tapes import SeedPorts, Values, effort_kernel
from .packed_scene import Frames
from .system import ForceNumbers, Indices, LawNumbers, LawRun, Numbers

# --- hinge laws -----------------------------------------------------------------------------------

_ZERO = number(0)

#: Bound that no coordinate reaches, for a stop on one side only.
_UNREACHABLE = 1e300


class Draft(NamedTuple):
    """Law on hinge `member` of a pattern, with one effort expression per speed."""

    member: int
    kernel: str
    coordinate: int
    speed: int
    p: Numbers
    efforts: list[Expression]
    axes: Numbers = ()


def law_runs(
    scene: Scene, topology: Topology, layout: Layout, values: Values, memory: int
) -> Iterator[LawRun]:
    """Laws of all runs that have any.

    Of a chain one period of its pattern is computed.  Laws that track a rotation angle store it in
    memory from index `memory` on.
    """
    for run in topology.runs:
        is_chain = run.body >= len(scene.body)
        period = scene.chain[scene.bodies.member(run.body)[0]].period if is_chain else 1
        period = min(period, run.count)
        pattern = [draft for k in range(period) for draft in _member_laws(scene, layout, run, k)]
        if pattern:
            law_run = _repeat_pattern(scene, values, run, period, pattern, memory)
            memory = law_run.next_angle_index
            yield law_run


def _member_laws(scene: Scene, layout: Layout, run: BodyRow, k: int) -> list[Draft]:
    """Laws of the hinge of member k."""
    hinge, slots = scene.hinges[run.hinge + k], layout.slots(run.hinge + k)
    if slots.nu == 0 or hinge.is_weld:
        return []
    if slots.quaternion is None or not _is_built_in(hinge):
        return _coordinate_laws(hinge, slots, k)
    return _rotational_laws(hinge, slots, k)


def _repeat_pattern(
    scene: Scene, values: Values, run: BodyRow, period: int, pattern: list[Draft], twist: int
) -> LawRun:
    """Repeat a pattern along a run and find the indices of its efforts and rotation angles."""
    repeats, rest = divmod(run.count, period)
    count = repeats * len(pattern) + sum(draft.member < rest for draft in pattern)
    common = ("t", *scene.channels)
    varies = [any(_is_hinge_specific(e, common) for e in draft.efforts) for draft in pattern]
    places: list[list[Indices]] = [[] for _ in pattern]
    for row in range(count if any(varies) else len(pattern)):
        repeat, k = divmod(row, len(pattern))
        if repeat == 0 or varies[k]:
            draft = pattern[k]
            hinge = scene.hinges[run.hinge + repeat * period + draft.member]
            places[k].append(tuple(values.value_index(effort, hinge) for effort in draft.efforts))
    laws, turns = [], 0
    for draft, effort_places in zip(pattern, places, strict=True):
        member, kernel, coordinate, speed, p, efforts, axes = draft
        turn, n = turns if axes else -1, len(efforts)
        turns += bool(axes)
        per_repeat = tuple(effort_places)
        laws.append(LawNumbers(member, kernel, coordinate, speed, n, turn, p, axes, per_repeat))
    return LawRun(run.position, count, period, tuple(laws), twist)


def _is_hinge_specific(effort: Expression, common: Collection[str]) -> bool:
    """Whether an expression has a name whose meaning depends on the hinge."""
    return any(len(name.parts) == 1 and name.text not in common for name in effort.names)


def _acts(entry: LawEntry) -> bool:
    return bool(entry.stiffness or entry.damping or not entry.effort.is_zero)


def _coordinate_laws(hinge: Hinge, slots: HingeSlots, member: int) -> list[Draft]:
    """One law for each coordinate with a spring, damper, effort, friction or elastic stop."""
    laws = []
    for k in range(slots.nu):
        entry = hinge.law.entry(k)
        full = entry.friction.acts or entry.limits.is_compliant
        if not (_acts(entry) or full):
            continue
        p = (
            entry.stiffness,
            entry.rest,
            entry.damping,
            *(_friction_and_stops(entry) if full else ()),
        )
        laws.append(Draft(member, "full" if full else "linear", k, k, p, [entry.effort]))
    return laws


def _friction_and_stops(entry: LawEntry) -> Numbers:
    """Parameters of the kernel "full" after those of the kernel "linear"."""
    friction, limits = entry.friction, entry.limits
    return (
        friction.coulomb, friction.static, friction.stribeck_velocity,
        friction.regularisation_velocity,
        -_UNREACHABLE if limits.lower is None or not limits.is_compliant else limits.lower,
        _UNREACHABLE if limits.upper is None or not limits.is_compliant else limits.upper,
        limits.stiffness, limits.damping,
    )  # fmt: skip


def _is_built_in(hinge: Hinge) -> bool:
    """Whether the law kernels know the indices of the hinge's rotation in q and u."""
    return hinge.facts is not None and hinge.facts.runs_as in builtin_hinges()


def _rotational_laws(hinge: Hinge, slots: HingeSlots, member: int) -> list[Draft]:
    """Laws of a hinge with a quaternion: springs from a potential, dampers, efforts; friction."""
    entries = [hinge.law.entry(k) for k in range(slots.nu)]
    laws = []
    if any(_acts(entry) for entry in entries):
        translations, rotations = entries[:-3], entries[-3:]
        p = [getattr(e, key) for key in ("stiffness", "rest", "damping") for e in translations]
        p += [e.stiffness for e in rotations] + [0.0] + [e.damping for e in rotations]
        axes = tuple(x for row in twist_axes(hinge) for x in row)
        kernel, efforts = "six" if translations else "rotation", [e.effort for e in entries]
        laws.append(Draft(member, kernel, 0, 0, tuple(p), efforts, axes))
    for k, entry in enumerate(entries):
        if entry.friction.acts:
            numbers = (0.0, 0.0, 0.0, *_friction_and_stops(entry))
            laws.append(Draft(member, "full", 0, k, numbers, [_ZERO]))
    return laws


# --- force elements -------------------------------------------------------------------------------


def force_element_numbers(
    frames: Frames, nodes: Scene, moving: SeedPorts
) -> tuple[ForceNumbers, ...]:
    """Numbers of the springs, then the bushings, of the scene of nodes, in this order."""
    springs = (_spring_numbers(frames, spring, moving) for spring in nodes.spring)
    return (*springs, *(_bushing_numbers(frames, bushing) for bushing in nodes.bushing))


def _spring_numbers(frames: Frames, spring: Spring, moving: SeedPorts) -> ForceNumbers:
    """Force element between the ends of a spring, with its effort expression if it has one."""
    element = frames.elements.get("force", spring.type, spring.name)
    from_end, to_end = (
        (body, axes, spring.position if body < 0 else offset)
        for body, axes, offset in map(frames.end, (spring.from_, spring.to))
    )
    law, effort = spring.law, None
    if spring.type == "spring":
        p: Numbers = (law.stiffness, law.rest, law.damping)
        if not law.effort.is_zero:
            effort = effort_kernel(law.effort, frames.layout, moving)
    else:
        p = declared_numbers(element.declared, spring.parameters, f'spring "{spring.name}"')
    return ForceNumbers(("force", spring.type), (from_end, to_end), p, effort)


def _bushing_numbers(frames: Frames, bushing: Bushing) -> ForceNumbers:
    """Force element between the unloaded pose, fixed to the body of `from`, and the end `to`.

    The axes of its two ends coincide in the unloaded pose.
    """
    body, axes, position = _end(frames, bushing, bushing.from_)
    bushing_axes = product(axes, bushing.rotation)
    shift = rotate(bushing_axes, bushing.rest.position)
    rest = (position[0] + shift[0], position[1] + shift[1], position[2] + shift[2])
    to_body, to_axes, to_position = _end(frames, bushing, bushing.to)
    to_axes = product(to_axes, transpose(bushing.rest.rotation))
    ends = (
        (body, _row_major_entries(bushing_axes), rest),
        (to_body, _row_major_entries(to_axes), to_position),
    )
    return ForceNumbers(("force", bushing.element), ends, bushing.numbers, None)


def _end(frames: Frames, bushing: Bushing, reference: str) -> tuple[int, Matrix, Vector]:
    """Position in the tree, axes and offset (m) of an end."""
    body, (a, b, c, d, e, f, g, h, i), offset = frames.end(reference)
    x, y, z = bushing.position if body < 0 else offset
    return body, to_matrix([[a, b, c], [d, e, f], [g, h, i]]), (x, y, z)


def _row_major_entries(matrix: Matrix) -> Numbers:
    return (*matrix[0], *matrix[1], *matrix[2])
