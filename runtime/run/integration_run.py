"""Run of a model by the C integrator, advanced in slices of wall time until it ends."""

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
from ..integrate.steppers.alpha_family import NewmarkFamily
from ..packing.scene_packing import reject_loop_method, reject_speed_constraints
from ..platform_support.interrupts import record_interrupts
from .method_switching import MethodChoice
from .run_messages import rest_note, step_too_long_note, stop_message, switch_notes
from .scene_system import SceneSystem
from .trajectory import Trajectory

#: Seconds of wall time between updates of progress, interrupts and checkpoints.
SLICE = 0.1

#: Bytes of samples at which a run without output times stops.
MAX_SAMPLE_BYTES = 2**30

#: Quaternions that are normalised at once.
_QUATERNION_BLOCK = 2**18

#: Energy (J) of a system at a time (s) and a state.
Energy = Callable[[SceneSystem, float, Array], float]

#: Tolerance of the work, a by-product of a run, in multiples of rtol times the energy.
_WORK_TOLERANCE = 10.0


def make_run(
    system: SceneSystem, settings: Settings, q: ArrayLike, u: ArrayLike,
    capacity: int | None = None, energy: Energy | None = None,
) -> Integrator:  # fmt: skip
    """Integrator at the start of a run, with a buffer of `capacity` samples.

    `energy` computes the energy of the start; default `energy_at`.
    """
    tableau = initial_method(system, settings)
    start = system.begin(settings.t_start, q, u)
    if uses_position_constraints(settings):
        system.enforce_positions()
    time_map = system.engine.packed.time_map(settings.t_start, settings.t_end)
    return Integrator(
        system.engine.ffi, system.engine.lib, system.system, tableau, settings, start,
        atol=tolerances(system, settings, start, energy), breaks=time_map.breaks,
        bounds=(time_map.starts, time_map.longest), pole=time_map.pole, capacity=capacity,
    )  # fmt: skip


def initial_method(system: SceneSystem, settings: Settings) -> Tableau:
    """First method of a run; prepares the system for it.

    Raises SceneError where the scene or the step does not suit the method.
    """
    tableau = get(settings.first_method, settings.radius)
    if tableau.implicit:
        reject_loop_method(system.engine.packed, settings.method, settings.tangent)
        if uses_position_constraints(settings):
            reject_speed_constraints(system.engine.packed, settings.method)
        system.offer_tangent()
    check_steps(tableau, settings.step)
    return tableau


def uses_position_constraints(settings: Settings) -> bool:
    """True if steps satisfy closed loops at position level at their ends, not at speed level."""
    tableau = get(settings.first_method, settings.radius)
    return isinstance(tableau, NewmarkFamily) and tableau.on_positions


def tolerances(
    system: SceneSystem, settings: Settings, start: Array, energy: Energy | None = None
) -> Array:
    """Absolute tolerance per state component; that of the work is scaled by the start energy."""
    atol = np.full(len(start), settings.atol)
    if system.has_power:
        start_energy = (energy or energy_at)(system, settings.t_start, start)
        atol[-1] = settings.atol + _WORK_TOLERANCE * settings.rtol * (start_energy or 1.0)
    return atol


def energy_at(system: SceneSystem, t: float, y: Array) -> float:
    """Sum of the absolute energies of a state in J.

    0 where the accelerations cannot be computed, which the run reports.  Raises NumericalFailure
    where only the energy cannot be computed.
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
        or f"energy at t = {t:.9g} s: not finite; check masses, speeds and stiffnesses for "
        "values far too large"
    )


def method_choice(system: SceneSystem, settings: Settings, run: Integrator) -> MethodChoice | None:
    """Choice of method for a new run of method "auto", else None."""
    return MethodChoice(system, settings, run) if settings.method == AUTO else None


def advance(
    run: Integrator,
    observe: Callable[[Integrator], None] | None = None,
    steps: int = 0,
    choice: MethodChoice | None = None,
) -> Status | None:
    """Advance a run to its end and return its status.

    None if it was interrupted or its samples reach MAX_SAMPLE_BYTES; RUNNING when it has made
    `steps` steps in all.  `observe` is called between slices.
    """
    with record_interrupts() as interrupted:
        while True:
            status = run.advance(SLICE, steps)
            if choice is not None:
                choice.switch_if_indicated(run)
                status = Status.RUNNING if choice.rescue(run) else status
            if status is not Status.RUNNING or run.steps == steps:
                return status
            if observe is not None:
                observe(run)
            if interrupted or run.kept_bytes > MAX_SAMPLE_BYTES:
                return None


def trajectory(
    system: SceneSystem,
    run: Integrator,
    settings: Settings,
    status: Status | None,
    message: str,
    earlier: Samples | None = None,
) -> Trajectory:
    """Trajectory of a run, after the samples of an earlier process."""
    samples = run.samples if earlier is None else Samples.join([earlier, run.samples])
    failure = run.failure
    if status is Status.STOPPED and rest_note(system, run.event):
        status = Status.CAME_TO_REST
    result = split(
        system, samples, settings, status, message, run.statistics, (run.t, run.y),
        None if failure is None else failure.time,
    )  # fmt: skip
    risks = (
        *switch_notes(system, run.chatter, run.missed_condition), *step_too_long_note(result)
    )  # fmt: skip
    return replace(result, risks=risks) if risks else result


def status_message(system: SceneSystem, run: Integrator, status: Status | None) -> str:
    """Sentence on the status of a run; status None means interrupted."""
    if status is not None:
        return stop_message(system, run)
    if run.kept_bytes <= MAX_SAMPLE_BYTES:
        return f"interrupted at t = {run.t:.9g} s"
    return (
        f"interrupted at t = {run.t:.9g} s, because the samples of all steps fill "
        f"{run.kept_bytes / 2**30:.1f} GiB; give output times, or check whether the scene is stiff"
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
    """Split samples into the arrays of a trajectory; keep only output times if these are given."""
    times = settings.output_times
    if times is not None and (samples.t.tolist() != list(times) or samples.event.any()):
        is_output = _is_among(samples.t, np.asarray(times)) & (samples.event >= 0)
        # An event at an output time has several samples: keep the state after it.
        is_last = np.append(samples.t[1:] != samples.t[:-1], True)
        keep = is_output & is_last[: len(is_output)]
        samples = Samples(
            samples.t[keep], samples.y[keep], samples.memory[keep], samples.event[keep]
        )
    nq, nu = system.engine.nq, system.engine.nu
    y, residual = project_samples(system, samples.t, samples.y, samples.memory)
    work = y[:, nq + nu] if system.has_power else np.zeros(len(samples.t))
    return Trajectory(
        samples.t, y[:, :nq], y[:, nq : nq + nu], samples.memory, work, samples.event, status,
        message, settings, statistics, fail_time, (), residual,
        (last[0], last[1][:nq], last[1][nq : nq + nu]),
    )  # fmt: skip


def _is_among(t: Array, times: Array) -> NDArray[np.bool_]:
    """Mask (n,) of the `t` (n,) that are among the increasing `times`."""
    if not len(times):
        return np.zeros(len(t), bool)
    return np.asarray(times[np.minimum(np.searchsorted(times, t), len(times) - 1)] == t)


def _has_constraints(engine: LoopedEngine) -> bool:
    """True if drives or closed loops determine some coordinates."""
    return bool(engine.packed.system.driven or engine.packed.system.has_loops)


def needs_projection(engine: LoopedEngine) -> bool:
    """True if `project_samples` may change the states of steps."""
    return _has_constraints(engine) or bool(len(engine.packed.layout.quaternions))


def project_samples(system: SceneSystem, t: Array, y: Array, memory: Array) -> tuple[Array, float]:
    """Project samples (n, n_state) onto unit quaternions, exact drives and closed loops.

    Between steps the samples are the method's dense output, which satisfies these only within the
    tolerance.  Also returns the largest deviation of a quaternion's length from 1.
    """
    engine, y, residual = system.engine, y.copy(), 0.0
    if not needs_projection(engine):
        return y, residual
    quaternions = engine.packed.layout.quaternions
    entries = quaternions[:, None] + np.arange(4) if len(quaternions) else quaternions
    row_count = max(1, _QUATERNION_BLOCK // max(1, len(entries)))
    for first in range(0, len(y) if len(entries) else 0, row_count):
        block = y[first : first + row_count]
        lengths = np.sqrt(np.sum(block[:, entries] ** 2, axis=2))
        residual = max(residual, float(np.max(np.abs(lengths - 1), initial=0.0)))
        with np.errstate(invalid="ignore"):  # the run itself reports a quaternion of zeros
            block[:, entries] /= lengths[:, :, None]
    if _has_constraints(engine):
        times, row_memory = np.ascontiguousarray(t), memory.copy()
        engine.lib.mstmm_scene_settle_many(
            system.run, len(y), y.shape[1], engine.pointer(times), engine.pointer(row_memory),
            engine.pointer(y),
        )  # fmt: skip
    return y, residual
