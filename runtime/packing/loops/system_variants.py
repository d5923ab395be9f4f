"""The same loops in another light: with coordinates held, or with bodies that are all alike."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..bodies import RIGID
from ..system import DIRECTIONS, Arrays, BodyNumbers, BodyRun, ClosureNumbers, System

#: Gap of a row that repeats others, in parts of the length of the scene, at which a rigid mechanism
#: locks.
LOCKED = 1e-3
#: Stiffness of the slowest mode, as a mass, in parts of that of the scene.
_SLOW = 1e8
#: Radius of gyration of a body in the metric of the geometry, in parts of the length.
_GYRATION = 1.0 / 3.0


def with_speeds_prescribed(system: System, places: Collection[int]) -> System:
    """With all speeds of the hinges at some places imposed, but for those of chains."""
    if not places:
        return system
    runs = tuple(_run_held(run) if run.place in places else run for run in system.bodies)
    speeds = {run.place: run.alike[0].nu for run in runs if run.place in places}
    closures = tuple(
        _closure_held(one, speeds[one.frame]) if one.frame in places else one
        for one in system.closures
    )
    return replace(system, bodies=runs, closures=closures)


def _run_held(run: BodyRun) -> BodyRun:
    if run.count != 1:
        return run
    body = run.alike[0]
    return replace(run, alike=(replace(body, imposed=(1,) * body.nu, release=-1),))


def _closure_held(one: ClosureNumbers, speeds: int) -> ClosureNumbers:
    others = (k for k in one.directions if k >= speeds)
    held = (*range(speeds), *others)
    return replace(one, directions=held, choice=_counting(one, len(held) - len(one.directions)))


def _counting(one: ClosureNumbers, more: int) -> tuple[int, int] | None:
    """The choice of a closure of which so many rows more count."""
    return None if one.choice is None else (one.choice[0], one.choice[1] + more)


def with_coupling_values(system: System, values: Sequence[float]) -> System:
    """With couplings whose values were not known keeping these, of all couplings in their order."""
    couplings = tuple(
        replace(one, kept=float(value)) if one.kept is None else one
        for one, value in zip(system.couplings, values, strict=True)
    )
    return replace(system, couplings=couplings)


def with_row_choice(system: System, counts: Mapping[int, int]) -> System:
    """With rows that are chosen anew along the way, so many as `counts` says of the closures whose
    frames are at some places; whether each is at rest stands in memory before what inputs hold."""
    closures, first = list[ClosureNumbers](), system.held.first
    for one in system.closures:
        if one.frame in counts:
            one = replace(one, choice=(first, counts[one.frame]))
            first += DIRECTIONS
        closures.append(one)
    more = first - system.held.first
    places = tuple(place + more * (place >= 0) for place in system.held.places)
    held = replace(system.held, first=first, places=places)
    return replace(system, closures=tuple(closures), held=held, n_memory=system.n_memory + more)


def without_rows(
    system: System, rows: Collection[tuple[int, int]], couplings: Collection[str] = ()
) -> System:
    """Without some rows, each given by the place of its closure's frame and its direction, and
    those of some couplings by their names."""
    closures = tuple(
        replace(one, directions=tuple(k for k in one.directions if (one.frame, k) not in rows))
        for one in system.closures
    )
    left = tuple(
        replace(one, repeats=one.repeats or one.name in couplings) for one in system.couplings
    )
    return replace(system, closures=closures, couplings=left)


def without_drives(system: System) -> System:
    """With the same speeds imposed, but by nobody: they are what a state says."""
    return replace(system, drives=None, driven=())


def with_drives_released(system: System) -> System:
    """With what drives impose free, but for hinges of chains, which stand still."""
    driven = set(system.driven)
    runs = tuple(_run_freed(run, driven) for run in system.bodies)
    closures = tuple(_closure_freed(one, system, driven) for one in system.closures)
    return replace(without_drives(system), bodies=runs, closures=closures)


def _run_freed(run: BodyRun, driven: Collection[tuple[int, int]]) -> BodyRun:
    if run.count != 1:
        return run
    body = run.alike[0]
    imposed = tuple(x and (run.place, k) not in driven for k, x in enumerate(body.imposed))
    return replace(run, alike=(replace(body, imposed=tuple(map(int, imposed))),))


def _closure_freed(
    one: ClosureNumbers, system: System, driven: Collection[tuple[int, int]]
) -> ClosureNumbers:
    rotor = system.body(one.frame).rotor
    free = {k for k, inertia in enumerate(rotor) if (one.frame, k) in driven and not inertia}
    left = tuple(k for k in one.directions if k not in free)
    return replace(one, directions=left, choice=_counting(one, len(left) - len(one.directions)))


def with_loops_open(system: System) -> System:
    """With the loops open: a tree in which a hinge that closes one carries a frame without mass."""
    return replace(system, closures=(), couplings=(), coupled=None)


def with_stiff_modes(system: System) -> System:
    """With modal masses that stand for the stiffness of flexible bodies: they bend where nothing
    else closes a loop."""

    mass = sum(body.body_p[0] for body in system.distinct if body.body[1] == RIGID)

    def made(body: BodyNumbers) -> BodyNumbers:
        if body.modal is None:
            return body
        modal, moments = body.modal, dict(body.modal.moments.named)
        stiffness = modal.matrices.named["stiffness"]
        least = float(np.min(np.diag(stiffness), initial=np.inf))
        most = max(mass, float(np.max(np.diag(moments["M"]), initial=0.0)))
        moments["M"] = moments["M"] + _SLOW * most / least * stiffness
        return replace(body, modal=replace(modal, moments=Arrays(moments)))

    runs = tuple(replace(run, alike=tuple(map(made, run.alike))) for run in system.bodies)
    return replace(system, bodies=runs)


def characteristic_length(system: System) -> float:
    """Root mean square distance between hinges, m; 1 where all of them meet in one point."""
    squares = [sum(x * x for x in body.connection[9:12]) for body in system.distinct]
    squares += [sum(x * x for x in one.end) for one in system.closures]
    found = [square for square in squares if square > 0]
    return float(np.sqrt(np.mean(found))) if found else 1.0


def with_unit_masses(system: System) -> System:
    """With mass 1 at the input end of every rigid body, and one radius of gyration for all: what
    moves is not hidden behind what is heavy."""
    moment = _moment(system)
    numbers = (1.0, 0.0, 0.0, 0.0, moment, 0.0, 0.0, moment, 0.0, moment)
    return _with_bodies(system, lambda _, body: replace(body, body_p=numbers))


def with_hinge_inertia(system: System, slides: Mapping[int, Collection[int]]) -> System:
    """As `geometric`, with the inertia in the hinges and none in the bodies: what a row asks of the
    hinges of its loop is not hidden behind all that hangs on them.  `slides` are the speeds that
    move points, by the place of the hinge."""
    moment = _moment(system)

    def changed(place: int, body: BodyNumbers) -> BodyNumbers:
        rotor = tuple(1.0 if k in slides.get(place, ()) else moment for k in range(body.nu))
        return replace(body, body_p=(0.0,) * 10, rotor=rotor)

    return _with_bodies(system, changed)


def with_rotors(system: System, inertia: Sequence[float]) -> System:
    """With rotors of `inertia` (nu,) besides those there are on the hinges, but for what closes
    loops."""
    frames, first = {one.frame for one in system.closures}, system.places["u"].tolist()

    def turning(body: BodyNumbers, place: int) -> BodyNumbers:
        own = zip(body.rotor, inertia[first[place] : first[place] + body.nu], strict=True)
        return replace(body, rotor=tuple(float(one + more) for one, more in own))

    def made(run: BodyRun) -> BodyRun:
        last = len(run.alike) - 1
        places = [run.place + (k if k < last else run.count - 1) for k in range(last + 1)]
        return replace(run, alike=tuple(map(turning, run.alike, places)))

    runs = tuple(run if run.place in frames else made(run) for run in system.bodies)
    return replace(system, bodies=runs)


def _moment(system: System) -> float:
    return (_GYRATION * characteristic_length(system)) ** 2


def _with_bodies(system: System, changed: Callable[[int, BodyNumbers], BodyNumbers]) -> System:
    """With rigid bodies changed, each given with its place, but for the frames of closures and the
    ends and mass points of flexible bodies."""
    frames = {one.frame for one in system.closures}

    def made(run: BodyRun) -> BodyRun:
        alike = (changed(run.place, b) if _is_rigid(b) else b for b in run.alike)
        return replace(run, alike=tuple(alike))

    runs = tuple(run if run.place in frames else made(run) for run in system.bodies)
    return replace(system, bodies=runs)


def _is_rigid(body: BodyNumbers) -> bool:
    return body.body[1] == RIGID and body.modal is None and body.section is None
