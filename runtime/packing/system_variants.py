"""Variants of a system for the analysis of its loops: other constraints, drives or inertia."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from .bodies import RIGID
from .system import DIRECTIONS, Arrays, BodyNumbers, BodyRun, ClosureNumbers, System

#: Gap of a redundant row, relative to the length of the scene, at which a rigid mechanism locks.
LOCKING_GAP_FRACTION = 1e-3
#: Mass of the softest mode, relative to that of the scene, in `with_stiff_modes`.
_MODAL_MASS = 1e8
#: Radius of gyration of all bodies, relative to the length of the scene, in `with_unit_masses`.
_GYRATION = 1.0 / 3.0


def with_speeds_prescribed(system: System, places: Collection[int]) -> System:
    """Prescribe all speeds of the hinges at positions `places` in the tree, except of chains."""
    if not places:
        return system
    runs = tuple(
        _with_prescribed_run(run) if run.position in places else run for run in system.bodies
    )
    speeds = {run.position: run.members[0].nu for run in runs if run.position in places}
    closures = tuple(
        _with_prescribed_closure(closure, speeds[closure.frame])
        if closure.frame in places
        else closure
        for closure in system.closures
    )
    return replace(system, bodies=runs, closures=closures)


def _with_prescribed_run(run: BodyRun) -> BodyRun:
    if run.count != 1:
        return run
    body = run.members[0]
    return replace(run, members=(replace(body, imposed=(1,) * body.nu, release=-1),))


def _with_prescribed_closure(closure: ClosureNumbers, speeds: int) -> ClosureNumbers:
    """Closure with rows for the first `speeds` directions, too."""
    return _with_directions(
        closure, (*range(speeds), *(k for k in closure.directions if k >= speeds))
    )


def _with_directions(closure: ClosureNumbers, directions: tuple[int, ...]) -> ClosureNumbers:
    """Closure with rows in other directions; all added or removed ones count in its choice."""
    choice = closure.choice
    if choice is not None:
        choice = (choice[0], choice[1] + len(directions) - len(closure.directions))
    return replace(closure, directions=directions, choice=choice)


def with_coupling_values(system: System, values: Sequence[float]) -> System:
    """Set the constants of couplings that were unknown; `values` are for all couplings."""
    couplings = tuple(
        replace(coupling, constant=float(value)) if coupling.constant is None else coupling
        for coupling, value in zip(system.couplings, values, strict=True)
    )
    return replace(system, couplings=couplings)


def with_row_choice(system: System, counts: Mapping[int, int]) -> System:
    """Choose the active rows of some closures during the run.

    `counts` gives the number of active rows by the position of the closure's frame.  Memory holds
    whether each row is inactive, before the inputs held there.
    """
    closures, first = list[ClosureNumbers](), system.held_inputs.first
    for closure in system.closures:
        if closure.frame in counts:
            closure = replace(closure, choice=(first, counts[closure.frame]))
            first += DIRECTIONS
        closures.append(closure)
    shift = first - system.held_inputs.first
    places = tuple(place + shift * (place >= 0) for place in system.held_inputs.memory_indices)
    held = replace(system.held_inputs, first=first, memory_indices=places)
    return replace(
        system, closures=tuple(closures), held_inputs=held, n_memory=system.n_memory + shift
    )


def without_rows(
    system: System, rows: Collection[tuple[int, int]], couplings: Collection[str] = ()
) -> System:
    """Remove rows, given as (position of the closure's frame, direction), and named couplings."""
    closures = tuple(
        replace(
            closure,
            directions=tuple(k for k in closure.directions if (closure.frame, k) not in rows),
        )
        for closure in system.closures
    )
    remaining = tuple(
        replace(coupling, repeats=coupling.repeats or coupling.name in couplings)
        for coupling in system.couplings
    )
    return replace(system, closures=closures, couplings=remaining)


def without_drives(system: System) -> System:
    """Remove the drives; driven speeds stay prescribed, with the values of the state."""
    return replace(system, drives=None, driven=())


def with_drives_released(system: System) -> System:
    """Free the driven speeds, except of hinges in chains, which stay fixed."""
    driven = set(system.driven)
    runs = tuple(_with_free_run(run, driven) for run in system.bodies)
    closures = tuple(_with_free_closure(closure, system, driven) for closure in system.closures)
    return replace(without_drives(system), bodies=runs, closures=closures)


def _with_free_run(run: BodyRun, driven: Collection[tuple[int, int]]) -> BodyRun:
    if run.count != 1:
        return run
    body = run.members[0]
    imposed = tuple(x and (run.position, k) not in driven for k, x in enumerate(body.imposed))
    return replace(run, members=(replace(body, imposed=tuple(map(int, imposed))),))


def _with_free_closure(
    closure: ClosureNumbers, system: System, driven: Collection[tuple[int, int]]
) -> ClosureNumbers:
    rotor = system.body(closure.frame).rotor
    free = {k for k, inertia in enumerate(rotor) if (closure.frame, k) in driven and not inertia}
    return _with_directions(closure, tuple(k for k in closure.directions if k not in free))


def with_loops_open(system: System) -> System:
    """Open the loops: a tree in which cut hinges carry massless frames."""
    return replace(system, closures=(), couplings=(), coupling_kernel=None)


def with_stiff_modes(system: System) -> System:
    """Give modes large masses, in proportion to their stiffness, so that they move last.

    Used to close loops with the least deformation.
    """
    mass = sum(body.body_p[0] for body in system.distinct if body.body[1] == RIGID)

    def with_modal_masses(body: BodyNumbers) -> BodyNumbers:
        if body.modal is None:
            return body
        modal, moments = body.modal, dict(body.modal.moments.named)
        stiffness = modal.matrices.named["stiffness"]
        min_stiffness = float(np.min(np.diag(stiffness), initial=np.inf))
        max_mass = max(mass, float(np.max(np.diag(moments["M"]), initial=0.0)))
        moments["M"] = moments["M"] + _MODAL_MASS * max_mass / min_stiffness * stiffness
        return replace(body, modal=replace(modal, moments=Arrays(moments)))

    runs = tuple(
        replace(run, members=tuple(map(with_modal_masses, run.members))) for run in system.bodies
    )
    return replace(system, bodies=runs)


def characteristic_length(system: System) -> float:
    """Root mean square distance between hinges, m; 1 where all of them meet in one point."""
    squares = [sum(x * x for x in body.connection[9:12]) for body in system.distinct]
    squares += [sum(x * x for x in closure.end) for closure in system.closures]
    positive = [square for square in squares if square > 0]
    return float(np.sqrt(np.mean(positive))) if positive else 1.0


def with_unit_masses(system: System) -> System:
    """Give all rigid bodies mass 1 at the input end and the same radius of gyration.

    Mobility then depends on the geometry only, not on mass ratios.
    """
    moment = _unit_inertia(system)
    numbers = (1.0, 0.0, 0.0, 0.0, moment, 0.0, 0.0, moment, 0.0, moment)
    return _with_bodies(system, lambda _, body: replace(body, body_p=numbers))


def with_hinge_inertia(system: System, slides: Mapping[int, Collection[int]]) -> System:
    """Give inertia to the hinges only, and none to the bodies.

    The mobility of a row then depends on the hinges of its loop only, not on outboard bodies.
    `slides` are the translational speeds, by the position of the hinge in the tree.
    """
    moment = _unit_inertia(system)

    def with_rotor(place: int, body: BodyNumbers) -> BodyNumbers:
        rotor = tuple(1.0 if k in slides.get(place, ()) else moment for k in range(body.nu))
        return replace(body, body_p=(0.0,) * 10, rotor=rotor)

    return _with_bodies(system, with_rotor)


def with_rotors(system: System, inertia: Sequence[float]) -> System:
    """Add rotor inertia (nu,) to all hinges except the cut ones."""
    frames, first = (
        {closure.frame for closure in system.closures},
        system.first_indices["u"].tolist(),
    )

    def with_rotor(body: BodyNumbers, place: int) -> BodyNumbers:
        pairs = zip(body.rotor, inertia[first[place] : first[place] + body.nu], strict=True)
        return replace(body, rotor=tuple(float(own + added) for own, added in pairs))

    def with_run_rotors(run: BodyRun) -> BodyRun:
        last = len(run.members) - 1
        places = [run.position + (k if k < last else run.count - 1) for k in range(last + 1)]
        return replace(run, members=tuple(map(with_rotor, run.members, places)))

    runs = tuple(run if run.position in frames else with_run_rotors(run) for run in system.bodies)
    return replace(system, bodies=runs)


def _unit_inertia(system: System) -> float:
    """Moment of inertia of a unit mass with the common radius of gyration, kg m^2."""
    return (_GYRATION * characteristic_length(system)) ** 2


def _with_bodies(system: System, change: Callable[[int, BodyNumbers], BodyNumbers]) -> System:
    """Change rigid bodies, but not massless frames and nodes of flexible bodies.

    `change` maps (position in the tree, body) to the new body.
    """
    frames = {closure.frame for closure in system.closures}

    def with_changes(run: BodyRun) -> BodyRun:
        alike = (change(run.position, body) if _is_rigid(body) else body for body in run.members)
        return replace(run, members=tuple(alike))

    runs = tuple(run if run.position in frames else with_changes(run) for run in system.bodies)
    return replace(system, bodies=runs)


def _is_rigid(body: BodyNumbers) -> bool:
    return body.body[1] == RIGID and body.modal is None and body.section is None
