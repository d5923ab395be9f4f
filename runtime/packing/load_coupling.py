"""Coupling of bodies by loads: which loads depend on more than their own body's motion.

Loads in inertial axes, force elements to the ground and drag depend on the pose and velocity of
their own body: the tangent of the sweep includes them.  Loads in axes of other bodies, springs
between bodies, cut hinges and expressions of the state couple bodies across the tree.
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
class LoadDependence:
    """Dependence of the loads on the motion of bodies, which are given by position in the tree.

    Attributes:
        loads, forces: whether each load or force element depends on its own body only.
        own_load_bodies: bodies with such loads, and all bodies inboard of them.
        coupled_bodies: bodies with loads that depend on other bodies.
        load_sources: for each of `coupled_bodies`, the bodies on whose motion its loads depend.
        efforts: (value, speed) of each law effort that is an expression of the state.
        effort_sources: for each of `efforts`, the bodies whose coordinates and speeds it reads.
    """

    loads: tuple[bool, ...]
    forces: tuple[bool, ...]
    own_load_bodies: tuple[int, ...]
    coupled_bodies: tuple[int, ...]
    load_sources: tuple[frozenset[int], ...]
    efforts: tuple[tuple[int, int], ...]
    effort_sources: tuple[frozenset[int], ...]


def load_coupling(system: System) -> LoadDependence:
    """Dependence of the loads of a system on the motion of bodies."""
    value_readings = _value_readings(system)
    load_readings = [
        frozenset().union(*(value_readings[k] for k in _load_values(load))) for load in system.loads
    ]
    loads = tuple(
        load.axes == GROUND != load.body and not bodies
        for load, bodies in zip(system.loads, load_readings, strict=True)
    )
    efforts = tuple(_state_efforts(system, value_readings))
    own, watched = set[int](), dict[int, set[int]]()
    for load, is_own, bodies in zip(system.loads, loads, load_readings, strict=True):
        if is_own:
            own.add(load.body)
        elif bodies or load.axes != load.body:  # a follower load of given size needs no other body
            watched.setdefault(load.body, set()).update((load.body, load.axes), bodies)
    forces = list[bool]()
    for force in system.forces:
        ends, bodies = [body for body, _, _ in force.ends], _force_readings(system, force)
        forces.append(ends.count(GROUND) == 1 and not bodies)
        if forces[-1]:
            own.update(ends)
        for body in () if forces[-1] else ends:
            watched.setdefault(body, set()).update(ends, bodies)
    effort_readings = {speed: value_readings[value] for value, speed in efforts}
    for sides, bodies in _closure_couplings(system, effort_readings):
        for body in sides:
            watched.setdefault(body, set()).update(sides, bodies)
    across = tuple(sorted(watched.keys() - {GROUND}))
    return LoadDependence(
        loads, tuple(forces), _with_inboard_bodies(system, own | set(system.bodies_with_drag)),
        across, tuple(frozenset(watched[body] - {GROUND}) for body in across), efforts,
        tuple(value_readings[value] for value, _ in efforts),
    )  # fmt: skip


def _closure_couplings(
    system: System, effort_readings: Mapping[int, frozenset[int]]
) -> Iterator[tuple[tuple[int, int], frozenset[int]]]:
    """Bodies on both sides of each closure, and bodies that the efforts of its laws read.

    `effort_readings` are by speed.
    """
    if not system.closures:
        return
    first, parents = system.first_indices["u"].tolist(), system.parents.tolist()
    for closure in system.closures:
        frame = closure.frame
        speeds = range(first[frame], first[frame] + system.body(frame).nu)
        bodies = frozenset().union(*(effort_readings.get(k, frozenset()) for k in speeds))
        yield (parents[frame], closure.outboard), bodies


def _with_inboard_bodies(system: System, bodies: set[int]) -> tuple[int, ...]:
    """The bodies and all bodies inboard of them."""
    parents, result = system.parents, set[int]()
    for body in bodies:
        while body != GROUND and body not in result:
            result.add(body)
            body = int(parents[body])
    return tuple(sorted(result))


def _load_values(load: LoadNumbers) -> list[int]:
    """Indices of the expression values that are components of a load."""
    return [index for index in (*load.force, *load.moment) if index >= 0]


def _force_readings(system: System, force: ForceNumbers) -> frozenset[int]:
    """Bodies whose coordinates or speeds the effort expression of a force element reads."""
    if force.effort is None or not (reads_port(force.effort, "q") or reads_port(force.effort, "u")):
        return frozenset()
    owners = _owners(system)
    return frozenset().union(*(_read_body(x, owners) for x in read_elements(force.effort)))


def _state_efforts(
    system: System, value_readings: Sequence[frozenset[int]]
) -> Iterator[tuple[int, int]]:
    """(value, speed) of each law effort that is an expression of the state."""
    if not system.laws or not any(value_readings):
        return
    first = system.first_indices["u"]
    for run in system.laws:
        indices = (k for law in run.pattern for efforts in law.efforts for k in efforts)
        if any(k >= 0 and value_readings[k] for k in indices):
            for law, body, _, values in run.iterate_laws():
                for j, value in enumerate(values):
                    if value >= 0 and value_readings[value]:
                        yield value, int(first[body]) + law.speed + j


def _value_readings(system: System) -> list[frozenset[int]]:
    """For each expression value, the bodies whose coordinates or speeds it reads."""
    values = system.values
    if values is None:
        return []
    owners = _owners(system) if reads_port(values, "q") or reads_port(values, "u") else {}
    of_temporaries: dict[int, frozenset[int]] = {}
    of_values = [frozenset[int]()] * values.outputs[0].length(1)

    def readings(operand: Operand) -> frozenset[int]:
        if isinstance(operand, Temporary):
            return of_temporaries[operand.number]
        return _read_body(operand, owners)

    for statement in values.statements:
        if isinstance(statement, Assign):
            of_temporaries[statement.number] = frozenset().union(*map(readings, statement.args))
        elif isinstance(statement, Store):
            of_values[int(statement.index[0])] = readings(statement.value)
    return of_values


def _read_body(operand: Operand, owners: Mapping[str, Integers]) -> frozenset[int]:
    """Body of the coordinate or speed that an operand is; empty for other operands."""
    if not isinstance(operand, Element) or operand.port not in owners:
        return frozenset()
    return frozenset((int(owners[operand.port][int(operand.index[0])]),))


def _owners(system: System) -> dict[str, Integers]:
    """Position in the tree of the body that owns each coordinate "q" and speed "u"."""
    sizes = {"q": system.rows(lambda body: body.nq), "u": system.rows(lambda body: body.nu)}
    owners = {"q": np.full(system.nq, GROUND), "u": np.full(system.nu, GROUND)}
    for port, firsts in system.first_indices.items():
        count = sizes[port]
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        owners[port][np.repeat(firsts, count) + within] = np.repeat(np.arange(len(count)), count)
    for place in np.flatnonzero(system.rows(lambda body: body.modal is not None)):
        if modal := system.body(int(place)).modal:
            owners["q"][modal.q : modal.q + modal.n] = place
            owners["u"][modal.u : modal.u + modal.n] = place
    return owners
