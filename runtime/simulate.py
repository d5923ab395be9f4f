"""One run of a model: the scene as the integrator's system, advanced in slices until it ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure, SceneError
from mstmm.tape import Tape

from . import values
from .endings import message_of
from .engine import Engine, Probe
from .fused import FusedLibrary
from .integrate import Run, Samples, Statistics, Status
from .interruptible import interruptible
from .layout import StateNames
from .pack import resize
from .run_notes import unseen
from .settings import Settings
from .steppers import get
from .switches import MOST

#: Seconds between looks at progress, interrupts and checkpoints.
SLICE = 0.1

#: Bytes of samples at which a run stops and asks for output times.
LARGEST = 2**30

#: Quaternions that are settled at once.
_QUATERNIONS = 2**18

#: The work is a by-product of a run: it may err by this many times rtol of the energy.
_WORK_TOLERANCE = 10.0


@dataclass(frozen=True)
class Trajectory:
    """States of a run: t (n,), q (n, nq), u (n, nu), memory (n, m), work (n,) in J, event (n,).

    q and u hold unit quaternions and exact driven coordinates; `norm_residual` is how far the
    quaternions' lengths were from 1 before.  `last` is (t, q, u) of the last good state and `start`
    (q, u) at the beginning, which output times may leave out.
    """

    t: Array
    q: Array
    u: Array
    memory: Array
    work: Array
    event: NDArray[np.int64]
    status: Status | None  # None: interrupted
    message: str
    settings: Settings
    statistics: Statistics
    fail_time: float | None = None
    notes: tuple[str, ...] = field(default=())
    norm_residual: float = 0.0
    last: tuple[float, Array, Array] | None = None
    start: tuple[Array, Array] | None = None
    unseen: tuple[str, ...] = ()  # of expressions: what the steps may have passed over

    @property
    def first(self) -> tuple[float, Array, Array]:
        """(t, q, u) of the beginning; of the first sample where an older file knows no other."""
        if self.start is not None:
            return (self.settings.t_start, *self.start)
        if not len(self.t):
            raise SceneError("the file of this result does not tell how its run began")
        return float(self.t[0]), self.q[0], self.u[0]

    @property
    def success(self) -> bool:
        """True if the run reached its end or an event stopped it, with finite numbers."""
        done = self.status in (Status.FINISHED, Status.STOPPED)
        return done and bool(np.isfinite(self.q).all() and np.isfinite(self.u).all())


@dataclass(frozen=True)
class Compiled:
    """Code compiled for a scene: for one state, for several side by side, and their numbers."""

    one: FusedLibrary
    lanes: FusedLibrary | None
    numbers: Array


class SceneSystem:
    """`mstmm_system` of a model: events, power and memory of its own.

    With `compiled` the right-hand side is that code; events and settling stay with the engine.
    Without `with_power` the work of what is not stored is not integrated.
    """

    def __init__(
        self, engine: Engine, compiled: Compiled | None = None, with_power: bool = True
    ) -> None:
        packed, ffi = engine.packed, engine.ffi
        self.engine, self.kept = engine, list[Any]()
        actions, self.event_names = _actions(engine)
        self.switches = packed.watched.switches
        self.memory = engine.start_memory()
        model = packed.model
        self.run = run = ffi.new("mstmm_scene_run *")
        run.model = model
        works = bool(model.n_laws or model.n_drives or model.n_loads or model.n_forces)
        works = works or any(
            body.D.any() or body.drag is not None for body in packed.flexible.values()
        )
        run.with_power = int(with_power and works)
        run.memory = engine.pointer(self.memory)
        first = np.append(packed.layout.quaternions, 0).astype(np.int32)
        run.quaternions = ffi.from_buffer("int[]", first)
        run.n_quaternions = len(packed.layout.quaternions)
        self.kept += [model, first]
        if packed.watched.tape is not None:
            self._events(packed.watched.tape, packed.watched.ends, actions)
        self.workspace = np.zeros(int(model.workspace))
        run.workspace = engine.pointer(self.workspace)
        if compiled is not None:
            self._compiled(compiled)
        self.system = ffi.new("mstmm_system *")
        engine.lib.mstmm_scene_system(run, self.system)

    def _compiled(self, code: Compiled) -> None:
        engine, lib = self.engine, self.engine.lib
        lanes = engine.ffi.NULL if code.lanes is None else code.lanes.descriptor
        numbers = np.ascontiguousarray(code.numbers)
        scratch = np.zeros(max(1, lib.mstmm_compiled_size(code.one.descriptor, lanes)))
        pointers = engine.pointer(numbers), engine.pointer(scratch)
        lib.mstmm_scene_compiled(self.run, code.one.descriptor, lanes, *pointers)
        self.kept += [code, numbers, scratch, *pointers]

    def _events(
        self, tape: Tape, ends: Sequence[tuple[str, str]], actions: list[tuple[int, int]]
    ) -> None:
        engine, ffi, run = self.engine, self.engine.ffi, self.run
        resize(engine.packed, tape.slots)
        run.event_tape = values.c_tape(ffi, tape, self.kept)
        probes = [Probe(*engine.packed.end(b + (f".{e}" if e else ""))) for b, e in ends]
        records = engine.probes(probes)
        numbers = np.zeros(6 * len(probes) + int(engine.lib.MSTMM_PROBE_NUMBERS))
        run.probes, run.n_probes = records, len(probes)
        run.probe_values = engine.pointer(numbers)
        table = ffi.new("mstmm_event_action[]", max(1, len(actions)))
        for record, (action, release) in zip(table, actions, strict=False):
            record.action, record.release = action, release
        run.events, run.n_events = table, len(actions)
        run.n_switches = min(len(self.switches), MOST)
        self.kept += [records, numbers, table]

    @property
    def with_power(self) -> bool:
        """True if the state ends with the work of everything that is not stored."""
        return bool(self.run.with_power)

    def start(self, t: float, q: ArrayLike, u: ArrayLike) -> Array:
        """State vector at t with driven coordinates, quaternions and memory in order."""
        y = np.concatenate(
            [np.asarray(q, float), np.asarray(u, float), np.zeros(int(self.with_power))]
        )
        y = np.ascontiguousarray(y)
        self.engine.lib.mstmm_scene_settle(self.run, t, self.engine.pointer(y))
        return y

    def components(self) -> StateNames:
        """A name per component of the state."""
        return StateNames(self.engine.packed.layout, self.with_power)


def _actions(engine: Engine) -> tuple[list[tuple[int, int]], list[str]]:
    """(action, memory place) and name of every event and release."""
    packed, lib = engine.packed, engine.lib
    actions: list[tuple[int, int]] = []
    names: list[str] = []
    for event in packed.scene.event:
        stops = event.do == "stop"
        release = -1 if stops else packed.releases[str(event.hinge)]
        actions.append((lib.MSTMM_FIRE_STOP if stops else lib.MSTMM_FIRE_RESTART, release))
        names.append(f'event "{event.name}"')
    for hinge in packed.scene.hinge:
        if hinge.release is not None:
            actions.append((lib.MSTMM_FIRE_RESTART, packed.releases[hinge.name]))
            names.append(f'release of hinge "{hinge.name}"')
    return actions, names


def make_run(system: SceneSystem, settings: Settings, q: ArrayLike, u: ArrayLike) -> Run:
    """The integrator at the start of the run."""
    tableau = get(settings.method)
    if settings.step is None and not tableau.adaptive:
        raise SceneError(
            f"method {settings.method!r} takes fixed steps: give step in s, or use dopri5, dop853"
        )
    start = system.start(settings.t_start, q, u)
    known = system.engine.packed.time_map(settings.t_start, settings.t_end)
    return Run(
        system.engine.ffi, system.engine.lib, system.system, tableau,
        t_start=settings.t_start, t_end=settings.t_end,
        y0=start, rtol=settings.rtol, atol=tolerances(system, settings, start),
        step=settings.step, output_times=settings.output_times, breaks=known.breaks,
        bounds=(known.starts, known.longest),
        max_step=settings.max_step, max_steps=settings.max_steps, first_step=settings.first_step,
    )  # fmt: skip


def tolerances(system: SceneSystem, settings: Settings, start: Array) -> Array:
    """Absolute tolerance per component; that of the work follows the energy of the start (J)."""
    found = np.full(len(start), settings.atol)
    if system.with_power:
        energy = _energy(system, settings.t_start, start) or 1.0
        found[-1] = settings.atol + _WORK_TOLERANCE * settings.rtol * energy
    return found


def _energy(system: SceneSystem, t: float, y: Array) -> float:
    """Sum of the sizes of the energies of a state, J; 0 where the motion itself cannot be computed,
    which the run will say.

    Raises NumericalFailure where the motion can, but not what the state shows.
    """
    engine, memory = system.engine, system.memory[None]
    q, u = y[None, : engine.nq].copy(), y[None, engine.nq : engine.nq + engine.nu].copy()
    seen = engine.observe(np.array([t]), q, u, memory, parts=("sums",))
    energy = float(np.abs(seen.sums[0, :3]).sum())
    if np.isfinite(energy):
        return energy
    try:
        engine.accelerations(t, q, u, memory.copy())
    except NumericalFailure:
        return 0.0
    raise NumericalFailure(
        seen.failures[0]
        if seen.failures
        else f"the energy at t = {t:.9g} s is not finite; see "
        "whether masses, speeds and stiffnesses are of the size that was meant"
    )


def advance(
    run: Run, observe: Callable[[Run], None] | None = None, steps: int = 0
) -> Status | None:
    """Run to the end; None if an interrupt came first or the samples fill the memory they may take.

    `observe` is called between slices.  RUNNING when so many steps have been made in all.
    """
    with interruptible() as interrupted:
        while True:
            status = run.advance(SLICE, steps)
            if status is not Status.RUNNING or run.statistics.steps == steps:
                return status
            if observe is not None:
                observe(run)
            if interrupted[0] or run.kept_bytes > LARGEST:
                return None


def trajectory(
    system: SceneSystem,
    run: Run,
    settings: Settings,
    status: Status | None,
    message: str,
    earlier: Samples | None = None,
) -> Trajectory:
    """Samples of a run, behind those of an earlier process, split into q, u and work."""
    samples = run.samples if earlier is None else Samples.joined([earlier, run.samples])
    failure = run.failure
    found = split(
        system, samples, settings, status, message, run.statistics, (run.t, run.y),
        None if failure is None else failure.time,
    )  # fmt: skip
    return replace(found, unseen=unseen(system, settings, run.chatter))


def said(system: SceneSystem, run: Run, status: Status | None) -> str:
    """How a run came back, as a sentence; None for interrupted."""
    return _interrupted(run) if status is None else message_of(system, run)


def _interrupted(run: Run) -> str:
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
    y, residual = settled(system, samples.t, samples.y, samples.memory)
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


def settled(system: SceneSystem, t: Array, y: Array, memory: Array) -> tuple[Array, float]:
    """Samples (n, n_state) with unit quaternions and exact driven coordinates.

    Between steps the samples are the method's dense output, which meets both only within the
    tolerance.  Also returns the largest distance of a quaternion's length from 1.
    """
    engine, y, residual = system.engine, y.copy(), 0.0
    quaternions = engine.packed.layout.quaternions
    entries = quaternions[:, None] + np.arange(4) if len(quaternions) else quaternions
    rows = max(1, _QUATERNIONS // max(1, len(entries)))
    for first in range(0, len(y) if len(entries) else 0, rows):
        some = y[first : first + rows]
        lengths = np.sqrt(np.sum(some[:, entries] ** 2, axis=2))
        residual = max(residual, float(np.max(np.abs(lengths - 1), initial=0.0)))
        with np.errstate(invalid="ignore"):  # a quaternion of zeros is named by the run itself
            some[:, entries] /= lengths[:, :, None]
    if engine.packed.model.n_drives:
        times, known = np.ascontiguousarray(t), memory.copy()
        engine.lib.mstmm_scene_settle_many(
            system.run, len(y), y.shape[1], engine.pointer(times), engine.pointer(known),
            engine.pointer(y),
        )  # fmt: skip
    return y, residual
