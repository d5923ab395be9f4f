"""Making the runs behind a Result: the run itself, checkpoints, the second run for its error."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError, SceneError

from ..engine.failure_source import REMEDY
from ..integrate.c_loop import Integrator, Samples, Status
from ..integrate.settings import Settings
from ..platform_support.interrupts import record_interrupts
from . import classical_run, external_integrators
from . import engine_choice as compiled_run
from .checkpoint import Checkpoint, State
from .error_estimate import ErrorEstimate, compare, made_same_steps, reference_settings
from .integration_run import advance, choice_of, status_message, trajectory
from .method_switching import Choice
from .start_cache import StartCache, return_start_cache, take_start_cache
from .step_stability import check_later, check_step
from .trajectory import Trajectory

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..engine.looped_engine import LoopedEngine
    from .scene_system import SceneSystem

Progress = Callable[[float, float], None]

#: Speeds, rad/s or m/s, that no motion has.
_WILD = 1e9
#: Seconds of wall time between checkpoints.
CHECKPOINT_EVERY = 30.0


class RunMonitor:
    """What goes on beside a run: progress, checkpoints, and notes of what went wrong with these.

    With two runs, each counts for half of the time that progress tells.  A run by a method that was
    not `named`, and that has kept to its first one, is recorded as one by that.
    """

    def __init__(
        self, progress: Progress | None, settings: Settings, runs: int = 1, named: bool = True
    ) -> None:
        self.progress, self.settings, self.runs = progress, settings, runs
        self.named = named
        self.run, self.notes = 0, list[str]()
        self.checkpoint: Checkpoint | None = None
        self.engine = compiled_run.LOOPED
        self.choice: Choice | None = None
        self.before = 0.0  # s of wall time that earlier processes spent on the run
        self._begun = self._saved = time.monotonic()

    def tell(self, t: float) -> None:
        """Report that the run is at time t (s).  What the callback raises ends the run."""
        if self.progress is None:
            return
        start, end = self.settings.t_start, self.settings.t_end
        self.progress(start + ((t - start) + self.run * (end - start)) / self.runs, end)

    def look(self, run: Integrator, earlier: Samples | None) -> None:
        """Between slices of a run: progress, and a checkpoint when one is due, or before what the
        callback of progress raises."""
        try:
            self.tell(run.t)
        except BaseException:
            self.save(run, earlier)
            raise
        if time.monotonic() - self._saved > CHECKPOINT_EVERY:
            self.save(run, earlier)

    def save(self, run: Integrator, earlier: Samples | None, message: str = "") -> None:
        """A checkpoint now, with how the run has ended if it has.

        If it cannot be written the run goes on and a note says so.
        """
        if self.checkpoint is not None and self.run == 0:
            try:
                methods = "" if self.choice is None else self.choice.state()
                said = {"engine": self.engine, "message": message, "methods": methods}
                words = {name: np.array(text) for name, text in said.items()}
                words["seconds"] = np.array(self.before + time.monotonic() - self._begun)
                self.checkpoint.save({**run.state(), **words}, _joined(earlier, run.samples))
            except (MstmmError, MemoryError) as error:
                note = f"no checkpoint: {error or 'there is not enough memory'}"
                if note not in self.notes:
                    self.notes.append(note)
        self._saved = time.monotonic()


def _joined(earlier: Samples | None, samples: Samples) -> Samples:
    return samples if earlier is None else Samples.joined([earlier, samples])


def first_run(
    model: CompiledScene,
    settings: Settings,
    q: Array,
    u: Array,
    watch: RunMonitor,
    resume: bool = False,
    beginnings: StartCache | None = None,
) -> Trajectory:
    """The run from (q, u), or from the checkpoint.  Its failures are put down to a fixed
    step that is too long.  `beginnings` are those of further runs from there; without, those of the
    model's last run serve where they fit."""
    if settings.method in classical_run.METHODS or settings.method in external_integrators.METHODS:
        if watch.checkpoint is not None:
            raise SceneError(f'method "{settings.method}" keeps no checkpoints; use dop853')
        others = classical_run if settings.method in classical_run.METHODS else external_integrators
        return others.integrate(model, settings, q, u, watch.tell)
    classical_run.refuse_options(settings)
    state, earlier = _continued(watch.checkpoint) if resume else (None, None)
    recorded = None if state is None else str(state["engine"])
    engine, compiled = model.looped, compiled_run.at_once(model, settings, recorded)
    at_start = take_start_cache(model, settings) if beginnings is None else beginnings
    begin = at_start.begin
    system, run = begin(engine, compiled, settings, q, u)
    watch.choice = choice_of(system, settings, run)
    message = "" if run.status is Status.RUNNING else status_message(system, run, run.status)
    if state is not None and earlier is not None and watch.checkpoint is not None:
        message = _restored(run, state, earlier, watch.checkpoint, watch.choice)
        watch.before = float(state["seconds"])
    look = 0 if compiled else compiled_run.look_after(model, settings)
    status: Status | None = run.status
    if look and status is Status.RUNNING and run.steps < look:
        watch.engine = compiled_run.LOOPED
        status, message = _advanced(system, run, watch, earlier, look)
        if status is Status.RUNNING:
            compiled = compiled_run.worth_compiling(model, settings, run)
        if compiled is not None:
            (system, run), earlier = begin(engine, compiled, settings, q, u), None
            watch.choice = choice_of(system, settings, run)
    watch.engine = compiled_run.FUSED if compiled else compiled_run.LOOPED
    if status is Status.RUNNING:
        status, message = _advanced(system, run, watch, earlier)
    stretches = () if watch.choice is None else tuple(watch.choice.stretches)
    if not watch.named and len(stretches) == 1:
        settings, stretches = replace(settings, method=settings.first_method), ()
    found = trajectory(system, run, settings, status, message, earlier)
    if watch.before:
        found = replace(found, before=watch.before)
    if stretches:
        found = replace(found, methods=stretches)
    if status is not None and not found.is_comparable:
        found = replace(found, message=_cause(engine, found, q, u))
    if beginnings is None:
        return_start_cache(model, settings, at_start)
    return found


def _cause(engine: LoopedEngine, run: Trajectory, q: Array, u: Array) -> str:
    """Why a run failed: its step where that is too long, at the start or, for numbers that grew
    beyond all bounds, later, unless an expression stopped it."""
    step = check_step(engine, run.settings, q, u)
    wild = run.status is Status.NOT_FINITE or float(np.abs(run.u).max(initial=0.0)) > _WILD
    if (step is None or step.risk is None) and wild and REMEDY not in run.message:
        step = check_later(engine, run) or step
    return run.message if step is None else step.blamed(run.message)


def _advanced(
    system: SceneSystem, run: Integrator, watch: RunMonitor, earlier: Samples | None, steps: int = 0
) -> tuple[Status | None, str]:
    """Advance a run and keep what it became: no interrupt comes between the two."""
    with record_interrupts():
        status = advance(run, lambda now: watch.look(now, earlier), steps, watch.choice)
        message = status_message(system, run, status)
        if status is not Status.RUNNING:
            watch.save(run, earlier, "" if status is None else message)
    return status, message


def _restored(
    run: Integrator, state: State, earlier: Samples, checkpoint: Checkpoint, choice: Choice | None
) -> str:
    """Put a run where its checkpoint was taken; returns how it had ended, "" if it had not."""
    try:
        if choice is not None:
            choice.restore(run, str(state["methods"]))
        run.restore(state)
        ended = run.status is not Status.RUNNING
    except ValueError:  # a status or a method that does not exist
        raise checkpoint.damaged("a state that no run can have") from None
    if not run.fits(earlier):
        raise checkpoint.damaged("samples of another size")
    return str(state["message"]) if ended else ""


def _continued(checkpoint: Checkpoint | None) -> tuple[State | None, Samples | None]:
    """State and samples of a run that was interrupted; None where there is none."""
    if checkpoint is None or not checkpoint.exists():
        return None, None
    return checkpoint.load()


def second_run(
    model: CompiledScene, first: Trajectory, q: Array, u: Array, watch: RunMonitor
) -> ErrorEstimate | None:
    """Error of `first` by a more accurate run; None, with a note, if that leads nowhere."""
    known = model.packed.time_map(first.settings.t_start, first.settings.t_end)
    settings, reference = reference_settings(first, known.breaks.tolist())
    watch.run = 1
    second = first_run(model, settings, q, u, watch)
    if not second.is_comparable:
        why = "it was interrupted" if second.status is None else second.message
        watch.notes.append(f"the second run, for the error, did not reach the end: {why}")
    if made_same_steps(first, second):
        watch.notes.append("no error estimate: the second run made the very steps of the first one")
        return None
    if not len(np.intersect1d(first.t, second.t)) or second.status is None:
        return None
    return compare(model.layout, first, second, reference, q)
