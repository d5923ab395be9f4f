"""How far loads reach: those that change with the place of their own body alone, and the others.

A load in the axes of space, a force element to the ground and drag change with where their body is
and how fast it goes: the tangent of the sweep takes them along.  Loads in axes of other bodies,
springs between bodies, hinges that close loops and what expressions of the state give reach across
the tree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mstmm.ir import Assign, Element, KernelIR, Operand, Store, Temporary
from mstmm.ir.kernel import reads

from .system import ForceNumbers, LoadNumbers, System

GROUND = -1


@dataclass(frozen=True)
class Reach:
    """`loads` and `forces` say of each whether it changes with the place of its body alone;
    `placed` are the places of the bodies that lead to such loads, `across` those on which others
    act, `watched` those by whose motion what acts on each of these changes, None where any may,
    `efforts` (value, speed) of every effort of a law that an expression of the state gives."""

    loads: tuple[bool, ...]
    forces: tuple[bool, ...]
    placed: tuple[int, ...]
    across: tuple[int, ...]
    watched: tuple[frozenset[int] | None, ...]
    efforts: tuple[tuple[int, int], ...]


def reach_of(system: System) -> Reach:
    """What the loads of a system reach."""
    depends = _depends_on_state(system.values)
    changing = [_reads_state(load, depends) for load in system.loads]
    loads = tuple(
        load.axes == GROUND != load.body and not reading
        for load, reading in zip(system.loads, changing, strict=True)
    )
    forces = tuple(map(_to_ground, system.forces))
    efforts = tuple(_efforts_of_state(system, depends))
    own, across = set[int](), _Across()
    for load, alone, reading in zip(system.loads, loads, changing, strict=True):
        if alone:
            own.add(load.body)
        elif reading or load.axes != load.body:  # a follower of given size turns with its body
            across.act([load.body], None if reading else [load.body, load.axes])
    for force, alone in zip(system.forces, forces, strict=True):
        ends = [body for body, _, _ in force.ends]
        if alone:
            own.update(ends)
        else:
            across.act(ends, None if _told(force) else ends)
    given = {speed for _, speed in efforts}
    places, parents = system.places["u"].tolist(), system.parents.tolist()
    for closure in system.closures:
        first = places[closure.frame]
        ends = [parents[closure.frame], closure.outboard]
        speeds = range(first, first + system.body(closure.frame).nu)
        across.act(ends, ends if given.isdisjoint(speeds) else None)
    return Reach(
        loads, forces, _to_the_root(system, own | set(system.dragged)), *across.found(), efforts
    )


class _Across:
    """Bodies on which others act, and those that each of them watches (None: any)."""

    def __init__(self) -> None:
        self._watched: dict[int, set[int] | None] = {}

    def act(self, bodies: Sequence[int], watched: Sequence[int] | None) -> None:
        for body in bodies:
            known = self._watched.setdefault(body, set())
            if known is not None and watched is not None:
                known.update(watched)
            else:
                self._watched[body] = None

    def found(self) -> tuple[tuple[int, ...], tuple[frozenset[int] | None, ...]]:
        places = tuple(sorted(self._watched.keys() - {GROUND}))
        all_of = [self._watched[place] for place in places]
        return places, tuple(None if one is None else frozenset(one - {GROUND}) for one in all_of)


def _to_the_root(system: System, bodies: set[int]) -> tuple[int, ...]:
    """The bodies and all that are inboard of them."""
    parents, found = system.parents, set[int]()
    for body in bodies:
        while body != GROUND and body not in found:
            found.add(body)
            body = int(parents[body])
    return tuple(sorted(found))


def _reads_state(load: LoadNumbers, depends: Sequence[bool]) -> bool:
    return any(depends[place] for place in (*load.force, *load.moment) if place >= 0)


def _to_ground(force: ForceNumbers) -> bool:
    ends = [body for body, _, _ in force.ends]
    return ends.count(GROUND) == 1 and not _told(force)


def _told(force: ForceNumbers) -> bool:
    """Whether an expression of the state gives its effort."""
    effort = force.effort
    return effort is not None and (reads(effort, "q") or reads(effort, "u"))


def _efforts_of_state(system: System, depends: Sequence[bool]) -> list[tuple[int, int]]:
    first = system.places["u"]
    return [
        (value, int(first[body]) + law.speed + j)
        for run in system.laws
        if any(x >= 0 and depends[x] for law in run.pattern for some in law.efforts for x in some)
        for law, body, _, values in run.each()
        for j, value in enumerate(values)
        if value >= 0 and depends[value]
    ]


def _depends_on_state(values: KernelIR | None) -> list[bool]:
    """Whether each value of the scene's expressions reads coordinates or speeds."""
    if values is None:
        return []
    reading: dict[int, bool] = {}
    found = [False] * values.outputs[0].length(1)

    def moving(operand: Operand) -> bool:
        if isinstance(operand, Temporary):
            return reading[operand.number]
        return isinstance(operand, Element) and operand.port in ("q", "u")

    for statement in values.statements:
        if isinstance(statement, Assign):
            reading[statement.number] = any(map(moving, statement.args))
        elif isinstance(statement, Store):
            found[int(statement.index[0])] = moving(statement.value)
    return found
