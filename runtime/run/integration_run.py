"""One run of a model: the scene as the integrator's system, advanced in slices until it ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..engine.looped_engine import LoopedEngine
from ..integrate.c_loop import Integrator, Samples, Statistics, Status
from ..integrate.settings import Settings
from ..integrate.steppers import AUTO, Tableau, check_steps, get
from ..integrate.steppers.implicit_methods import NewmarkFamily
from ..packing.loops.unsupported_loops import reject_loop_method, reject_speed_constraints
from ..platform_support.interrupts import record_interrupts
from .method_switching import Choice
from .run_notes import chattering_note, step_too_long_note, unseen
from .scene_system import SceneSystem
from .stop_messages import message_of, rest_of
from .trajectory import Trajectory

#: Seconds between looks at progress, interrupts and checkpoints.
SLICE = 0.1

#: Bytes of samples at which a run stops and asks for output times.
LARGEST = 2**30

#: Quaternions that are settled at once.
_QUATERNIONS = 2**18

#: The energy (J) of a system at a time (s) in a state.
Energy = Callable[[SceneSystem, float, Array], float]

#: The work is a by-product of a run: it may err by this many times rtol of the energy.
_WORK_TOLERANCE = 10.0


def make_run(
    system: SceneSystem, settings: Settings, q: ArrayLike, u: ArrayLike,
    capacity: int | None = None, energy: Energy | None = None,
) -> Integrator:  # fmt: skip
    """The integrator at the start of the run, with room for so many samples at a time; `energy` is
    who knows that of the start."""
    tableau = initial_method(system, settings)
    start = system.begin(settings.t_start, q, u)
    if asks_positions(settings):
        system.ask_positions()
    known = system.engine.packed.time_map(settings.t_start, settings.t_end)
    return Integrator(
        system.engine.ffi, system.engine.lib, system.system, tableau, settings, start,
        atol=tolerances(system, settings, start, energy), breaks=known.breaks,
        bounds=(known.starts, known.longest), pole=known.pole, capacity=capacity,
    )  # fmt: skip


def initial_method(system: SceneSystem, settings: Settings) -> Tableau:
    """The method by which a run begins, of a system that has what it asks for."""
    tableau = get(settings.first_method, settings.radius)
    if tableau.implicit:
        reject_loop_method(system.engine.packed, settings.method, settings.tangent)
        if asks_positions(settings):
            reject_speed_constraints(system.engine.packed, settings.method)
        system.offer_tangent()
    check_steps(tableau, settings.step)
    return tableau


def asks_positions(settings: Settings) -> bool:
    """Whether steps ask rows of closed loops for positions where they end."""
    tableau = get(settings.first_method, settings.radius)
    return isinstance(tableau, NewmarkFamily) and tableau.on_positions


def tolerances(
    system: SceneSystem, settings: Settings, start: Array, energy: Energy | None = None
) -> Array:
    """Absolute tolerance per component; that of the work follows the energy of the start (J)."""
    found = np.full(len(start), settings.atol)
    if system.with_power:
        known = (energy or energy_at)(system, settings.t_start, start)
        found[-1] = settings.atol + _WORK_TOLERANCE * settings.rtol * (known or 1.0)
    return found


def energy_at(system: SceneSystem, t: float, y: Array) -> float:
    """Sum of the sizes of the energies of a state, J; 0 where the motion itself cannot be computed,
    which the run will say.

    Raises NumericalFailure where the motion can, but not what the state shows.
    """
    engine, memory = system.engine, system.memory
    q, u = y[: engine.nq], y[engine.nq : engine.nq + engine.nu]
    sums, failure = engine.sums(t, q, u, memory)
    energy = sum(map(abs, sums[:3].tolist()))
    if math.isfinite(energy):
        return energy
    try:
        engine.accelerations(t, q[None].copy(), u[None].copy(), memory[None].copy())
    except NumericalFailure:
        return 0.0
    raise NumericalFailure(
        failure
        or f"the energy at t = {t:.9g} s is not finite; see "
        "whether masses, speeds and stiffnesses are of the size that was meant"
    )


def choice_of(system: SceneSystem, settings: Settings, run: Integrator) -> Choice | None:
    """The choice among methods that goes with a run that has just been made."""
    return Choice(system, settings, run) if settings.method == AUTO else None


def advance(
    run: Integrator,
    observe: Callable[[Integrator], None] | None = None,
    steps: int = 0,
    choice: Choice | None = None,
) -> Status | None:
    """Run to the end; None if an interrupt came first or the samples fill the memory they may take.

    `observe` is called between slices.  RUNNING when so many steps have been made in all.
    """
    with record_interrupts() as interrupted:
        while True:
            status = run.advance(SLICE, steps)
            if choice is not None:
                choice.look(run)
                status = Status.RUNNING if choice.rescue(run) else status
            if status is not Status.RUNNING or run.steps == steps:
                return status
            if observe is not None:
                observe(run)
            if interrupted or run.kept_bytes > LARGEST:
                return None


def trajectory(
    system: SceneSystem,
    run: Integrator,
    settings: Settings,
    status: Status | None,
    message: str,
    earlier: Samples | None = None,
) -> Trajectory:
    """Samples of a run, behind those of an earlier process, split into q, u and work."""
    samples = run.samples if earlier is None else Samples.joined([earlier, run.samples])
    failure = run.failure
    if status is Status.STOPPED and rest_of(system, run.event):
        status = Status.CAME_TO_REST
    found = split(
        system, samples, settings, status, message, run.statistics, (run.t, run.y),
        None if failure is None else failure.time,
    )  # fmt: skip
    held = () if run.chatter is None else (chattering_note(system, run.chatter),)
    missed = () if run.unseen is None else (unseen(system, *run.unseen),)
    risks = (*held, *missed, *step_too_long_note(found))
    return replace(found, risks=risks) if risks else found


def status_message(system: SceneSystem, run: Integrator, status: Status | None) -> str:
    """How a run came back, as a sentence; None for interrupted."""
    return _interrupted(run) if status is None else message_of(system, run)


def _interrupted(run: Integrator) -> str:
    if run.kept_bytes <= LARGEST:
        return f"interrupted at t = {run.t:.9g} s"
    return (
        f"interrupted at t = {run.t:.9g} s, because the samples of all steps fill "
        f"{run.kept_bytes / 2**30:.1f} GiB; ask for output times, or see whether the scene is stiff"
    )


def split(
    system: SceneSystem,
    samples: Samples,
    settings: Settings,
    status: Status | None,
    message: str,
    statistics: Statistics,
    last: tuple[float, Array],
    fail_time: float | None = None,
) -> Trajectory:
    """Trajectory of samples; with output times only those, not the events between."""
    times = settings.output_times
    if times is not None and (samples.t.tolist() != list(times) or samples.event.any()):
        wanted = _among(samples.t, np.asarray(times)) & (samples.event >= 0)
        behind = np.append(samples.t[1:] != samples.t[:-1], True)  # an event at such a time
        keep = wanted & behind[: len(wanted)]
        samples = Samples(
            samples.t[keep], samples.y[keep], samples.memory[keep], samples.event[keep]
        )
    nq, nu = system.engine.nq, system.engine.nu
    y, residual = project_samples(system, samples.t, samples.y, samples.memory)
    work = y[:, nq + nu] if system.with_power else np.zeros(len(samples.t))
    return Trajectory(
        samples.t, y[:, :nq], y[:, nq : nq + nu], samples.memory, work, samples.event, status,
        message, settings, statistics, fail_time, (), residual,
        (last[0], last[1][:nq], last[1][nq : nq + nu]),
    )  # fmt: skip


def _among(t: Array, times: Array) -> NDArray[np.bool_]:
    """Which of `t` are among the increasing `times`."""
    if not len(times):
        return np.zeros(len(t), bool)
    return np.asarray(times[np.minimum(np.searchsorted(times, t), len(times) - 1)] == t)


def _moved(engine: LoopedEngine) -> bool:
    """Whether drives or closed loops decide on some coordinates."""
    return bool(engine.packed.system.driven or engine.packed.system.closes)


def settles(engine: LoopedEngine) -> bool:
    """Whether states of steps may differ from what a result has."""
    return _moved(engine) or bool(len(engine.packed.layout.quaternions))


def project_samples(system: SceneSystem, t: Array, y: Array, memory: Array) -> tuple[Array, float]:
    """Samples (n, n_state) with unit quaternions, exact driven coordinates and closed loops.

    Between steps the samples are the method's dense output, which meets these only within the
    tolerance.  Also returns the largest distance of a quaternion's length from 1.
    """
    engine, y, residual = system.engine, y.copy(), 0.0
    if not settles(engine):
        return y, residual
    quaternions = engine.packed.layout.quaternions
    entries = quaternions[:, None] + np.arange(4) if len(quaternions) else quaternions
    rows = max(1, _QUATERNIONS // max(1, len(entries)))
    for first in range(0, len(y) if len(entries) else 0, rows):
        some = y[first : first + rows]
        lengths = np.sqrt(np.sum(some[:, entries] ** 2, axis=2))
        residual = max(residual, float(np.max(np.abs(lengths - 1), initial=0.0)))
        with np.errstate(invalid="ignore"):  # a quaternion of zeros is named by the run itself
            some[:, entries] /= lengths[:, :, None]
    if _moved(engine):
        times, known = np.ascontiguousarray(t), memory.copy()
        engine.lib.mstmm_scene_settle_many(
            system.run, len(y), y.shape[1], engine.pointer(times), engine.pointer(known),
            engine.pointer(y),
        )  # fmt: skip
    return y, residual
