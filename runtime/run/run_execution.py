"""Runs for a Result: engine, start, checkpoints, and the second run for the error.

The choice of the engine never depends on a clock.  A scene without fused code starts on the looped
engine.  After a given number of steps the evaluations of the whole run are extrapolated; if
compilation pays, the run restarts on fused code, so that its results do not depend on when this was
decided.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure, MstmmError, SceneError

from ..engine.compiled_scene import CompiledScene
from ..engine.failure_messages import REMEDY
from ..engine.looped_engine import LoopedEngine
from ..integrate.c_loop import Integrator, Samples, Status
from ..integrate.settings import Settings
from ..integrate.steppers import get
from ..platform_support.interrupts import record_interrupts
from . import classical_run, external_integrators
from .checkpoint import Checkpoint, State
from .error_estimate import ErrorEstimate, compare, made_same_steps, reference_settings
from .integration_run import (
    advance,
    energy_at,
    initial_method,
    make_run,
    method_choice,
    status_message,
    tolerances,
    trajectory,
    uses_position_constraints,
)
from .method_switching import MethodChoice
from .scene_system import SceneCode, SceneSystem
from .step_stability import check_later, check_step
from .trajectory import Trajectory

if TYPE_CHECKING:
    from ..kernels.scene_libraries import FusedLibrary


Progress = Callable[[float, float], None]

#: Speed in rad/s or m/s above which a run counts as diverged.
_DIVERGED_SPEED = 1e9
#: Seconds of wall time between checkpoints.
CHECKPOINT_INTERVAL = 30.0


class RunMonitor:
    """Progress reports and checkpoints of a run, and notes about failed checkpoints.

    With two `runs`, each is half of the reported progress.  A run whose method was not `named` by
    the caller and never changed is recorded under its first method instead of "auto".
    """

    def __init__(
        self, progress: Progress | None, settings: Settings, runs: int = 1, named: bool = True
    ) -> None:
        self.progress, self.settings, self.runs = progress, settings, runs
        self.named = named
        self.run, self.notes = 0, list[str]()
        self.checkpoint: Checkpoint | None = None
        self.engine = LOOPED
        self.choice: MethodChoice | None = None
        self.earlier_seconds = 0.0  # wall time in s of earlier processes on the run
        self._begun = self._saved = time.monotonic()

    def report_progress(self, t: float) -> None:
        """Report that the run has reached time t (s); an exception of the callback ends the run."""
        if self.progress is None:
            return
        start, end = self.settings.t_start, self.settings.t_end
        self.progress(start + ((t - start) + self.run * (end - start)) / self.runs, end)

    def report_and_save(self, run: Integrator, earlier: Samples | None) -> None:
        """Report progress between slices of a run, and save a checkpoint when one is due.

        An exception of the progress callback is raised after a checkpoint is saved.
        """
        try:
            self.report_progress(run.t)
        except BaseException:
            self.save(run, earlier)
            raise
        if time.monotonic() - self._saved > CHECKPOINT_INTERVAL:
            self.save(run, earlier)

    def save(self, run: Integrator, earlier: Samples | None, message: str = "") -> None:
        """Save a checkpoint; `message` tells how the run has ended, "" while it runs.

        If the file cannot be written, the run continues and a note is added.
        """
        if self.checkpoint is not None and self.run == 0:
            try:
                methods = "" if self.choice is None else self.choice.state()
                texts = {"engine": self.engine, "message": message, "methods": methods}
                entries = {name: np.array(text) for name, text in texts.items()}
                entries["seconds"] = np.array(self.earlier_seconds + time.monotonic() - self._begun)
                samples = run.samples
                samples = samples if earlier is None else Samples.join([earlier, samples])
                self.checkpoint.save({**run.state(), **entries}, samples)
            except (MstmmError, MemoryError) as error:
                note = f"no checkpoint written: {error or 'not enough memory'}"
                if note not in self.notes:
                    self.notes.append(note)
        self._saved = time.monotonic()


def first_run(
    model: CompiledScene,
    settings: Settings,
    q: Array,
    u: Array,
    watch: RunMonitor,
    resume: bool = False,
    beginnings: StartCache | None = None,
) -> Trajectory:
    """Run from (q, u), or restart from the checkpoint.

    A failure is attributed to the fixed step where that is too long.  `beginnings` is the start
    cache of several runs from the same start; default: that of the model's last run, if it fits.
    """
    if settings.method in classical_run.METHODS or settings.method in external_integrators.METHODS:
        if watch.checkpoint is not None:
            raise SceneError(f'method "{settings.method}" writes no checkpoints; use dop853')
        is_classical = settings.method in classical_run.METHODS
        package = classical_run if is_classical else external_integrators
        return package.integrate(model, settings, q, u, watch.report_progress)
    classical_run.reject_classical_options(settings)
    state: State | None = None
    earlier: Samples | None = None
    if resume and watch.checkpoint is not None and watch.checkpoint.exists():
        state, earlier = watch.checkpoint.load()
    recorded = None if state is None else str(state["engine"])
    engine, code = model.looped, code_at_start(model, settings, recorded)
    cache = take_start_cache(model, settings) if beginnings is None else beginnings
    system, run = cache.begin(engine, code, settings, q, u)
    watch.choice = method_choice(system, settings, run)
    message = "" if run.status is Status.RUNNING else status_message(system, run, run.status)
    if state is not None and earlier is not None and watch.checkpoint is not None:
        message = _restore_run(run, state, earlier, watch.checkpoint, watch.choice)
        watch.earlier_seconds = float(state["seconds"])
    decision_step = 0 if code else steps_until_decision(model, settings)
    status: Status | None = run.status
    if decision_step and status is Status.RUNNING and run.steps < decision_step:
        watch.engine = LOOPED
        status, message = _advance_and_save(system, run, watch, earlier, decision_step)
        if status is Status.RUNNING:
            code = code_if_it_pays(model, settings, run)
        if code is not None:
            (system, run), earlier = cache.begin(engine, code, settings, q, u), None
            watch.choice = method_choice(system, settings, run)
    watch.engine = FUSED if code else LOOPED
    if status is Status.RUNNING:
        status, message = _advance_and_save(system, run, watch, earlier)
    segments = () if watch.choice is None else tuple(watch.choice.segments)
    if not watch.named and len(segments) == 1:
        settings, segments = replace(settings, method=settings.first_method), ()
    result = trajectory(system, run, settings, status, message, earlier)
    if watch.earlier_seconds:
        result = replace(result, earlier_seconds=watch.earlier_seconds)
    if segments:
        result = replace(result, methods=segments)
    if status is not None and not result.is_comparable:
        result = replace(result, message=_failure_message(engine, result, q, u))
    if beginnings is None:
        return_start_cache(model, settings, cache)
    return result


def _failure_message(engine: LoopedEngine, run: Trajectory, q: Array, u: Array) -> str:
    """Message of a failed run, preceded by the fixed step where that is too long.

    The step is checked at the start and, in a diverged run that no expression stopped, later.
    """
    step = check_step(engine, run.settings, q, u)
    max_speed = float(np.abs(run.u).max(initial=0.0))
    diverged = run.status is Status.NOT_FINITE or max_speed > _DIVERGED_SPEED
    if (step is None or step.risk is None) and diverged and REMEDY not in run.message:
        step = check_later(engine, run) or step
    return run.message if step is None else step.explain_failure(run.message)


def _advance_and_save(
    system: SceneSystem, run: Integrator, watch: RunMonitor, earlier: Samples | None, steps: int = 0
) -> tuple[Status | None, str]:
    """Advance a run and save its end; no interrupt takes effect between the two."""
    with record_interrupts():
        status = advance(run, lambda now: watch.report_and_save(now, earlier), steps, watch.choice)
        message = status_message(system, run, status)
        if status is not Status.RUNNING:
            watch.save(run, earlier, "" if status is None else message)
    return status, message


def _restore_run(
    run: Integrator,
    state: State,
    earlier: Samples,
    checkpoint: Checkpoint,
    choice: MethodChoice | None,
) -> str:
    """Restore a run from its checkpoint; returns its final message, "" if it had not ended."""
    try:
        if choice is not None:
            choice.restore(run, str(state["methods"]))
        run.restore(state)
        ended = run.status is not Status.RUNNING
    except ValueError:  # a status or a method that does not exist
        raise checkpoint.damage_error("an impossible state") from None
    if not run.accepts(earlier):
        raise checkpoint.damage_error("samples of another size")
    return str(state["message"]) if ended else ""


def second_run(
    model: CompiledScene, first: Trajectory, q: Array, u: Array, watch: RunMonitor
) -> ErrorEstimate | None:
    """Estimate the error of `first` by a more accurate run; None where that gives no estimate.

    Failures of the second run and equal steps are noted in `watch`.
    """
    time_map = model.packed_scene.time_map(first.settings.t_start, first.settings.t_end)
    settings, reference = reference_settings(first, time_map.breaks.tolist())
    watch.run = 1
    second = first_run(model, settings, q, u, watch)
    if not second.is_comparable:
        reason = "it was interrupted" if second.status is None else second.message
        watch.notes.append(f"the second run, for the error, did not reach the end: {reason}")
    if made_same_steps(first, second):
        watch.notes.append("no error estimate: the second run made the same steps as the first")
        return None
    if not len(np.intersect1d(first.t, second.t)) or second.status is None:
        return None
    return compare(model.coordinate_layout, first, second, reference, q)


#: Evaluations after which the evaluations of the whole run are extrapolated.
_EXTRAPOLATE_AFTER = 2000

LOOPED, FUSED = "looped", "fused"


def code_at_start(
    model: CompiledScene, settings: Settings, recorded: str | None
) -> SceneCode | None:
    """Fused code for a run that starts now; None for the looped engine.

    Args:
        model: the model.
        settings: of the run.
        recorded: engine of the run that is restarted from a checkpoint; None for a new run.

    Raises EnvironmentFailure if a run on fused code is to be restarted where no code can be built.
    """
    if recorded == LOOPED:
        return None
    library = model.fusion.library
    if library is None and recorded == FUSED:
        try:
            library = model.fusion.build()
        except (EnvironmentFailure, SceneError) as error:
            raise EnvironmentFailure(
                f"checkpoint: the run began on fused code, which cannot be compiled now ({error}); "
                "run without resume to start again"
            ) from None
    return None if library is None else _scene_code(model, settings, library, math.inf)


def code_for_any_length(model: CompiledScene, settings: Settings) -> SceneCode | None:
    """Fused code for a run of unknown length, compiled if that can pay at all; else None."""
    library = model.fusion.ready(math.inf)
    return None if library is None else _scene_code(model, settings, library, math.inf)


def steps_until_decision(model: CompiledScene, settings: Settings) -> int:
    """Steps of a looped run after which `code_if_it_pays` is to be called; 0 for never."""
    if model.fusion.obstacle:
        return 0
    return math.ceil(_EXTRAPOLATE_AFTER / get(settings.first_method).n_stages)


def code_if_it_pays(model: CompiledScene, settings: Settings, run: Integrator) -> SceneCode | None:
    """Fused code if compilation pays for a looped run, extrapolated from its time so far."""
    elapsed = run.t - settings.t_start
    if not elapsed > 0.0:
        return None
    evaluations = run.statistics.evaluations * (settings.t_end - settings.t_start) / elapsed
    library = model.fusion.ready(evaluations)
    return None if library is None else _scene_code(model, settings, library, evaluations)


def _scene_code(
    model: CompiledScene, settings: Settings, library: FusedLibrary, evaluations: float
) -> SceneCode:
    """Code with SIMD lanes only for iterated methods; implicit code is compiled on first use."""
    fusion, iterated = model.fusion, get(settings.first_method).iterated is not None
    lanes = fusion.ready_lanes(evaluations) if iterated else None
    implicit = partial(fusion.ready_implicit, evaluations)
    return SceneCode(library, lanes, fusion.numbers, fusion.inputs, implicit)


#: Largest number of state components; runs of more take so long that reuse saves nothing.
_MAX_STATES = 200


class StartCache:
    """System and integrator for successive runs of one engine over the same times.

    They are reused while the fused code and the constraint level of the method are the same.
    """

    def __init__(self) -> None:
        self._cached: tuple[SceneSystem, Integrator] | None = None
        #: Time (s), state and energy (J) of the last start.
        self._start_energy: tuple[float, Array, float] | None = None

    def begin(
        self,
        engine: LoopedEngine,
        compiled: SceneCode | None,
        settings: Settings,
        q: Array,
        u: Array,
    ) -> tuple[SceneSystem, Integrator]:
        """System and integrator at the start of a run from (nq,), (nu,)."""
        position_level = uses_position_constraints(settings)
        system, run = self._cached or (None, None)
        if (
            system is None or run is None or not system.uses_code(compiled)
            or system.uses_position_level != position_level
        ):  # fmt: skip
            system = SceneSystem(engine, compiled)
            run = make_run(system, settings, q, u, energy=self._energy_at)
            self._cached = system, run
            return system, run
        tableau = initial_method(system, settings)
        system.memory[:] = engine.start_memory()
        start = system.begin(settings.t_start, q, u)
        run.start(tableau, settings, start, tolerances(system, settings, start, self._energy_at))
        return system, run

    def _energy_at(self, system: SceneSystem, t: float, start: Array) -> float:
        """Energy of the start in J, computed once for runs from the same start."""
        cached = self._start_energy
        if cached is None or cached[0] != t or not np.array_equal(cached[1], start):
            cached = self._start_energy = t, start.copy(), energy_at(system, t, start)
        return cached[2]


#: Start cache of a model's last run, with the times for which it is valid.
_last_caches: WeakKeyDictionary[CompiledScene, tuple[object, StartCache]] = WeakKeyDictionary()


def take_start_cache(model: CompiledScene, settings: Settings) -> StartCache:
    """Take the start cache of the model's last run if its times are the same, else a new one.

    Taking removes it, so that only one of several threads uses it.
    """
    times, cache = _last_caches.pop(model, (None, None))
    return StartCache() if cache is None or times != _times(settings) else cache


def return_start_cache(model: CompiledScene, settings: Settings, beginnings: StartCache) -> None:
    """Return the start cache of a finished run, for the model's next run."""
    if model.nq + model.nu <= _MAX_STATES:
        _last_caches[model] = _times(settings), beginnings


def _times(settings: Settings) -> object:
    return settings.t_start, settings.t_end, settings.output_times
