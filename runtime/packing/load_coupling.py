"""How far loads reach: those that change with the place of their own body alone, and the others.

A load in the axes of space, a force element to the ground and drag change with where their body is
and how fast it goes: the tangent of the sweep takes them along.  Loads in axes of other bodies,
springs between bodies, hinges that close loops and what expressions of the state give reach across
the tree.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Integers
from mstmm.ir import Assign, Element, Operand, Store, Temporary
from mstmm.ir.kernel import read_elements, reads_port

from .system import ForceNumbers, LoadNumbers, System

GROUND = -1


@dataclass(frozen=True)
class Reach:
    """`loads` and `forces` say of each whether it changes with the place of its body alone;
    `placed` are the places of the bodies that lead to such loads, `across` those on which others
    act, `watched` those by whose motion what acts on each of these changes, `efforts` (value,
    speed) of every effort of a law that an expression of the state gives, and `heard` the places
    of the bodies whose coordinates and speeds each of these reads."""

    loads: tuple[bool, ...]
    forces: tuple[bool, ...]
    placed: tuple[int, ...]
    across: tuple[int, ...]
    watched: tuple[frozenset[int], ...]
    efforts: tuple[tuple[int, int], ...]
    heard: tuple[frozenset[int], ...]


def load_coupling(system: System) -> Reach:
    """What the loads of a system reach."""
    heard = _heard(system)
    told = [frozenset().union(*(heard[k] for k in _values_of(load))) for load in system.loads]
    loads = tuple(
        load.axes == GROUND != load.body and not by_state
        for load, by_state in zip(system.loads, told, strict=True)
    )
    efforts = tuple(_efforts_of_state(system, heard))
    own, watched = set[int](), dict[int, set[int]]()
    for load, alone, by_state in zip(system.loads, loads, told, strict=True):
        if alone:
            own.add(load.body)
        elif by_state or load.axes != load.body:  # a follower of given size turns with its body
            watched.setdefault(load.body, set()).update((load.body, load.axes), by_state)
    forces = list[bool]()
    for force in system.forces:
        ends, by_state = [body for body, _, _ in force.ends], _told(system, force)
        forces.append(ends.count(GROUND) == 1 and not by_state)
        if forces[-1]:
            own.update(ends)
        for body in () if forces[-1] else ends:
            watched.setdefault(body, set()).update(ends, by_state)
    for sides, by_state in _closures(system, {speed: heard[value] for value, speed in efforts}):
        for body in sides:
            watched.setdefault(body, set()).update(sides, by_state)
    across = tuple(sorted(watched.keys() - {GROUND}))
    return Reach(
        loads, tuple(forces), _to_the_root(system, own | set(system.dragged)), across,
        tuple(frozenset(watched[body] - {GROUND}) for body in across),
        efforts, tuple(heard[value] for value, _ in efforts),
    )  # fmt: skip


def _closures(
    system: System, heard: Mapping[int, frozenset[int]]
) -> Iterator[tuple[tuple[int, int], frozenset[int]]]:
    """Bodies on both sides of what closes loops, and those that the efforts of its laws read, which
    are known by speed."""
    if not system.closures:
        return
    first, parents = system.places["u"].tolist(), system.parents.tolist()
    for one in system.closures:
        speeds = range(first[one.frame], first[one.frame] + system.body(one.frame).nu)
        read = frozenset().union(*(heard.get(speed, frozenset()) for speed in speeds))
        yield (parents[one.frame], one.outboard), read


def _to_the_root(system: System, bodies: set[int]) -> tuple[int, ...]:
    """The bodies and all that are inboard of them."""
    parents, found = system.parents, set[int]()
    for body in bodies:
        while body != GROUND and body not in found:
            found.add(body)
            body = int(parents[body])
    return tuple(sorted(found))


def _values_of(load: LoadNumbers) -> list[int]:
    """Values of expressions that are components of a load."""
    return [place for place in (*load.force, *load.moment) if place >= 0]


def _told(system: System, force: ForceNumbers) -> frozenset[int]:
    """Places of the bodies that the expression of a force reads."""
    if force.effort is None or not (reads_port(force.effort, "q") or reads_port(force.effort, "u")):
        return frozenset()
    owners = _owners(system)
    return frozenset().union(*(_read(x, owners) for x in read_elements(force.effort)))


def _efforts_of_state(system: System, heard: Sequence[frozenset[int]]) -> Iterator[tuple[int, int]]:
    if not system.laws or not any(heard):
        return
    first = system.places["u"]
    for run in system.laws:
        if any(x >= 0 and heard[x] for law in run.pattern for some in law.efforts for x in some):
            for law, body, _, values in run.each():
                for j, value in enumerate(values):
                    if value >= 0 and heard[value]:
                        yield value, int(first[body]) + law.speed + j


def _heard(system: System) -> list[frozenset[int]]:
    """Of each value of the scene's expressions, the places of the bodies whose coordinates and
    speeds it reads."""
    values = system.values
    if values is None:
        return []
    owners = _owners(system) if reads_port(values, "q") or reads_port(values, "u") else {}
    known: dict[int, frozenset[int]] = {}
    found = [frozenset[int]()] * values.outputs[0].length(1)

    def read(operand: Operand) -> frozenset[int]:
        if isinstance(operand, Temporary):
            return known[operand.number]
        return _read(operand, owners)

    for statement in values.statements:
        if isinstance(statement, Assign):
            known[statement.number] = frozenset().union(*map(read, statement.args))
        elif isinstance(statement, Store):
            found[int(statement.index[0])] = read(statement.value)
    return found


def _read(operand: Operand, owners: Mapping[str, Integers]) -> frozenset[int]:
    """The body whose number an operand is, if it is one of a coordinate or speed."""
    if not isinstance(operand, Element) or operand.port not in owners:
        return frozenset()
    return frozenset((int(owners[operand.port][int(operand.index[0])]),))


def _owners(system: System) -> dict[str, Integers]:
    """Place of the body that each coordinate "q" and speed "u" belongs to."""
    sizes = {"q": system.rows(lambda one: one.nq), "u": system.rows(lambda one: one.nu)}
    found = {"q": np.full(system.nq, GROUND), "u": np.full(system.nu, GROUND)}
    for port, firsts in system.places.items():
        count = sizes[port]
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        found[port][np.repeat(firsts, count) + within] = np.repeat(np.arange(len(count)), count)
    for place in np.flatnonzero(system.rows(lambda one: one.modal is not None)):
        if modal := system.body(int(place)).modal:
            found["q"][modal.q : modal.q + modal.n] = place
            found["u"][modal.u : modal.u + modal.n] = place
    return found
