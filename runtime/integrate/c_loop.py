"""Python driver of the time integration loop in `c/integrate.c`.

`Integrator` owns the arrays of a run and converts its status to messages.  It is independent of
mechanics: the system is a `mstmm_system` that the caller has filled, such as a scene, a test
system in C or a few cffi call-backs.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array, Integers
from mstmm.errors import SceneError
from mstmm.plain_data import stored_as

from .c_tableau import c_tableau
from .settings import Settings
from .steppers import TANGENTS, Tableau, check_size

_SAMPLE_DOUBLES = 2**19  # of one buffer, about 4 MB
_ARGUMENT_CHECKS = {
    1: "the sizes of state, events or memory",
    2: "the times: both finite, t_end not before t_start",
    3: "the tolerances or steps: absolute tolerances above zero, no negative value, "
    "and a method with an error estimate unless the step is fixed",
    4: "the breaks and the starts of bounds: finite and strictly increasing",
    5: "the output times: finite, strictly increasing and within the run",
    6: "the sample buffer",
}


class Status(IntEnum):
    """Reason that the C loop returned; negative values are failures (`MSTMM_*` of the C header).

    CAME_TO_REST does not exist in C: an event stopped the run because its bounces accumulate.
    """

    RUNNING = 0
    FINISHED = 1
    STOPPED = 2
    BUFFER_FULL = 3
    CAME_TO_REST = 4
    STEP_TOO_SMALL = -1
    NOT_FINITE = -2
    RHS_FAILED = -3
    ACCEPT_FAILED = -4
    EVENT_FAILED = -5
    FIRE_FAILED = -6
    TOO_MANY_STEPS = -7
    EVENT_CHATTER = -8
    BAD_ARGUMENT = -9
    TANGENT_FAILED = -10
    NOT_CONVERGED = -11
    LET_THROUGH = -12
    POLE = -13


_STATUS_BY_VALUE = {int(status): status for status in Status}


@dataclass(frozen=True)
class Samples:
    """Samples of a run, as rows of arrays.

    Attributes:
        t: (m,) times, s; equal neighbours are just before and just after an event.
        y: (m, n_state).
        memory: (m, n_memory).
        event: (m,) 0; -(i + 1) just before and i + 1 just after event i changed the state.
    """

    t: Array
    y: Array
    memory: Array
    event: Integers

    @staticmethod
    def join(parts: Sequence[Samples]) -> Samples:
        """Join the rows of `parts` (at least one)."""
        return Samples(
            np.concatenate([p.t for p in parts]),
            np.concatenate([p.y for p in parts]),
            np.concatenate([p.memory for p in parts]),
            np.concatenate([p.event for p in parts]),
        )


@dataclass(frozen=True)
class Failure:
    """Failure that stopped a run, with the indices from which its message is written."""

    status: Status
    time: float
    component: int | None
    event: int | None
    code: int


@dataclass(frozen=True)
class Statistics:
    """Counts and error estimates of a run so far.

    Attributes:
        steps, rejected_steps, evaluations, events: counts; evaluations are calls of the right-hand
            side.
        smallest_step, largest_step: of steps not shortened by a break, an event or the end (s).
        sum_of_local_errors: sum over all steps of the RMS local error estimate, in the units of y.
            The error of the result may be larger by any factor.
        sum_scaled_error: the same in units of the tolerance.  Both None without an estimate.
        stiffness_index: last estimate of h |lambda|; largest_stiffness_index its maximum.
        stability_limited: True if at least fifty steps, and a tenth of all, were about as long as
            stability permits: the system is stiff for an explicit method, or the fixed step is
            long.
        stability_limited_steps: number of these steps.
        switch_crossings: number of steps that ended where an expression of the state switches.
        residuals, tangents, solves, iterations: evaluations of the system by implicit methods, and
            iterations of Newton's method.
        approximate_tangents: number of approximate tangents, from inertia and laws only.
    """

    steps: int
    rejected_steps: int = field(metadata=stored_as("rejected"))
    evaluations: int
    events: int
    smallest_step: float | None
    largest_step: float | None
    sum_of_local_errors: float | None = field(metadata=stored_as("sum_local_error"))
    sum_scaled_error: float | None
    stiffness_index: float
    largest_stiffness_index: float
    stability_limited: bool
    stability_limited_steps: int
    switch_crossings: int = field(default=0, metadata=stored_as("crossings"))
    residuals: int = 0
    tangents: int = 0
    solves: int = 0
    iterations: int = 0
    approximate_tangents: int = field(default=0, metadata=stored_as("laws_tangents"))


class Integrator:
    """Time integration that the caller advances in slices.

    Args:
        ffi, lib: a cffi pair with the declarations of `c/integrate.h`.
        system: `mstmm_system *`, filled; kept alive by the run.
        tableau: the method, see `mstmm.runtime.integrate.steppers`.
        settings: times, tolerances and steps of the run; its method is `tableau`.
        y0: (n_state,).
        atol: absolute tolerance of every component, (n_error,), above zero; by default that of the
            settings.
        breaks: strictly increasing times (s) at which the right-hand side is not smooth.  Steps end
            there; the right-hand side is evaluated at the numbers before and after a break only.
        bounds: (starts, longest), s: from each start, the first at or before t_start, no adaptive
            step is longer.
        pole: the break (s) at which the right-hand side has a pole, where the run ends, and a
            sentence that names the pole.
        capacity: rows of the sample buffer, at least 2.

    Raises:
        SceneError: if an argument is invalid.
    """

    def __init__(
        self,
        ffi: Any,
        lib: Any,
        system: Any,
        tableau: Tableau,
        settings: Settings,
        y0: ArrayLike,
        *,
        atol: ArrayLike | None = None,
        breaks: ArrayLike = (),
        bounds: tuple[ArrayLike, ArrayLike] = ((), ()),
        pole: tuple[float, str] | None = None,
        capacity: int | None = None,
    ) -> None:
        self._ffi, self._lib, self._system = ffi, lib, system
        self._run = run = ffi.new("mstmm_run *")
        run.system = system
        self._outputs(run, settings.output_times)
        self.map_times(breaks, bounds, pole)
        self._buffer(run, capacity)
        self.start(tableau, settings, y0, atol)

    def start(
        self, tableau: Tableau, settings: Settings, y0: ArrayLike, atol: ArrayLike | None = None
    ) -> None:
        """Start the run, or start it again with another method or other tolerances.

        Times and output times remain those of the construction; samples not yet taken are lost.
        """
        self._check_method(tableau)
        system, run = self._system, self._run
        if settings.tangent == "laws" and not system.implicit.laws:
            raise SceneError('tangent = "laws": this system has no approximate tangent by laws')
        if settings.step is not None and not settings.step > 0.0:
            raise SceneError(f"step = {settings.step!r}: expected a time above zero, in s")
        self.tableau, run.tableau = tableau, c_tableau(self._ffi, tableau)
        run.t_start, run.t_end, run.rtol = settings.t_start, settings.t_end, settings.rtol
        run.fixed_step = 0.0 if settings.step is None else settings.step
        run.first_step, run.min_step = settings.first_step, settings.min_step
        run.max_step, run.max_steps = settings.max_step, settings.max_steps
        run.tangents = TANGENTS.index(settings.tangent)
        self.request_return(0)
        tolerances = np.full(system.n_error, settings.atol if atol is None else atol, np.float64)
        run.atol = self._atol = self._ffi.from_buffer("double[]", tolerances)
        run.workspace = self._space = self._make_workspace(run.tableau)
        self._samples: list[Samples] = []
        self.kept_bytes = 0  # of all samples so far
        y_start = np.array(y0, dtype=np.float64)
        if y_start.shape != (system.n_state,):
            raise SceneError(f"y0 has shape {y_start.shape}, expected ({system.n_state},)")
        if self._lib.mstmm_run_start(run, self._doubles(y_start)) == Status.BAD_ARGUMENT:
            raise SceneError(f"{tableau.name}: check {_ARGUMENT_CHECKS[run.count.code]}")

    def _check_method(self, tableau: Tableau) -> None:
        implicit_system = self._system.implicit
        if tableau.implicit and not implicit_system:
            raise SceneError(
                f'method "{tableau.name}" is implicit and needs a tangent of the equations of '
                "motion, which this system does not have; use an explicit method such as dop853"
            )
        if implicit_system:
            check_size(tableau, implicit_system.n_q + implicit_system.n_u)

    def _make_workspace(self, tableau: Any) -> Any:
        """Workspace for a method; it exists as long as the returned object."""
        size = self._lib.mstmm_workspace_size(self._system, tableau)
        return self._ffi.from_buffer("double[]", np.empty(max(size, 1)))

    def _doubles(self, array: ArrayLike) -> Any:
        """`double *` to a contiguous copy, which exists as long as the returned object."""
        return self._ffi.from_buffer("double[]", np.array(array, dtype=np.float64, order="C"))

    def _outputs(self, run: Any, output_times: ArrayLike | None) -> None:
        run.n_outputs = -1
        if output_times is not None:
            outputs = np.atleast_1d(np.asarray(output_times, dtype=np.float64))
            self._output_times = self._doubles(outputs)
            run.n_outputs, run.outputs = len(outputs), self._output_times

    def _buffer(self, run: Any, capacity: int | None) -> None:
        n, nm = self._system.n_state, self._system.n_memory
        if capacity is None:
            capacity = min(4096, max(2, _SAMPLE_DOUBLES // max(1, n + nm)))
        self._t, self._y = np.empty(capacity), np.empty((capacity, n))
        self._memory, self._event = np.empty((capacity, nm)), np.empty(capacity, dtype=np.int64)
        run.sample_capacity = capacity
        for name, array in (("sample_t", self._t), ("sample_y", self._y)):
            setattr(run, name, self._ffi.from_buffer("double[]", array))
        run.sample_memory = self._ffi.from_buffer("double[]", self._memory)
        run.sample_event = self._ffi.from_buffer("int64_t[]", self._event)

    def advance(self, wall: float = 0.1, steps: int = 0) -> Status:
        """Advance the run for `wall` seconds or to its end, emptying full buffers.

        Args:
            wall: wall time, s; infinite for no limit.
            steps: also return when the run has made so many steps in total; 0 for no limit.

        Returns:
            RUNNING, FINISHED, STOPPED or a failure; never BUFFER_FULL.
        """
        deadline = time.monotonic() + wall
        self._run.pause_steps = steps
        while True:
            remaining = max(0.0, deadline - time.monotonic())
            status = _STATUS_BY_VALUE[self._lib.mstmm_advance(self._run, remaining)]
            self._drain()
            if status is not Status.BUFFER_FULL:
                return status
            if remaining == 0.0:
                return Status.RUNNING

    @property
    def record(self) -> Any:
        """`mstmm_run *`, for C that advances the run itself."""
        return self._run

    def map_times(
        self, breaks: ArrayLike, bounds: tuple[ArrayLike, ArrayLike],
        pole: tuple[float, str] | None = None,
    ) -> None:  # fmt: skip
        """Replace breaks, bounds and pole, with the meanings of the constructor."""
        rows = [np.atleast_1d(np.array(x, dtype=np.float64)) for x in (breaks, *bounds)]
        break_pointer, starts, longest = (self._ffi.from_buffer("double[]", row) for row in rows)
        pole_pointer = self._ffi.NULL if pole is None else self._doubles([pole[0]])
        self._mapped = (len(rows[0]), break_pointer, len(rows[1]), starts, longest, pole_pointer)
        self.pole = pole
        self._lib.mstmm_run_map(self._run, *self._mapped)

    def take_over(self, other: Integrator) -> None:
        """Take over state, breaks, bounds and pole of another run with the same settings."""
        self._mapped, self._run.t_end = other._mapped, other._run.t_end
        self.pole = other.pole
        self._lib.mstmm_run_map(self._run, *self._mapped)
        self.restore(other.state())

    def request_return(self, signs: int, look: int = 0, short_step: float = 0.0) -> None:
        """Make `advance` return between steps, with `asked` True.

        Args:
            signs: return when so many of the last steps favoured another kind of method: with
                explicit methods steps as long as stability permits, with implicit ones steps below
                short_step.
            look: return when so many steps have been made in total.  For both, 0 is never.
            short_step: s.
        """
        self._run.sign_steps, self._run.look_steps = signs, look
        self._run.short_step = short_step

    @property
    def steps(self) -> int:
        """Number of steps made."""
        return int(self._run.count.steps)

    @property
    def callback_requested(self) -> bool:
        """True if the last `advance` returned because of `request_return`."""
        return bool(self._run.count.asked)

    @property
    def no_step(self) -> bool:
        """True if the run failed because its method finds no valid step from the current state."""
        return bool(self._run.count.no_step)

    @property
    def signs(self) -> int:
        """Number of the last steps that favoured another kind of method."""
        return int(self._run.count.sign)

    @property
    def last_step(self) -> float:
        """Length of the last step, s."""
        return float(self._run.real.h)

    def switch_method(self, tableau: Tableau) -> None:
        """Continue with another method from the current state, between steps or after `no_step`.

        Counts, samples, events and, except after a failure, the length of the next step are kept.
        Raises SceneError within a step, and for methods or runs with fixed steps.
        """
        self._check_method(tableau)
        c_method = c_tableau(self._ffi, tableau)
        workspace = self._make_workspace(c_method)
        if self._lib.mstmm_run_change(self._run, c_method, workspace):
            raise SceneError(f'method "{tableau.name}" cannot continue this run')
        self.tableau, self._space = tableau, workspace

    def _drain(self) -> None:
        m = int(self._run.n_samples)
        self._run.n_samples = 0
        if m:
            rows = (self._t, self._y, self._memory, self._event)
            t, y, memory, event = (x[:m].copy() for x in rows)
            self.kept_bytes += t.nbytes + y.nbytes + memory.nbytes + event.nbytes
            self._samples.append(Samples(t, y, memory, event))

    @property
    def samples(self) -> Samples:
        """All samples not yet taken."""
        n, nm = self._system.n_state, self._system.n_memory
        if not self._samples:
            return Samples(
                np.zeros(0), np.zeros((0, n)), np.zeros((0, nm)), np.zeros(0, dtype=np.int64)
            )
        if len(self._samples) > 1:
            self._samples = [Samples.join(self._samples)]
        return self._samples[0]

    def take_samples(self) -> Samples:
        """Return all samples not yet taken and remove them here (for writing during the run)."""
        samples = self.samples
        self._samples = []
        return samples

    @property
    def status(self) -> Status:
        """Status that the last `advance` returned."""
        status = _STATUS_BY_VALUE[self._run.count.status]
        return Status.RUNNING if status is Status.BUFFER_FULL else status

    @property
    def t(self) -> float:
        """Time of the current (after a failure: the last valid) state, s."""
        return float(self._run.real.t)

    @property
    def y(self) -> Array:
        """Copy of the current (after a failure: the last valid) state (n_state,)."""
        n = self._system.n_state
        pointer = self._lib.mstmm_run_y(self._run)
        data = self._ffi.buffer(pointer, n * 8)
        return np.frombuffer(data, dtype=np.float64, count=n).copy()

    @property
    def failure(self) -> Failure | None:
        """Failure of the run, None without one."""
        if self.status >= 0:
            return None
        counts = self._run.count
        component = int(counts.component) if counts.component >= 0 else None
        event = int(counts.event) if counts.event >= 0 else None
        failure_time = float(self._run.real.fail_time)
        return Failure(self.status, failure_time, component, event, int(counts.code))

    @property
    def statistics(self) -> Statistics:
        """Counts and estimates so far."""
        counts, reals = self._run.count, self._run.real
        adaptive = self.tableau.adaptive
        has_steps = counts.steps > 0 and reals.largest_step > 0.0
        return Statistics(
            steps=int(counts.steps),
            rejected_steps=int(counts.rejected),
            evaluations=int(counts.evaluations),
            events=int(counts.events_fired),
            smallest_step=float(reals.smallest_step) if has_steps else None,
            largest_step=float(reals.largest_step) if has_steps else None,
            sum_of_local_errors=float(reals.sum_local_error) if adaptive else None,
            sum_scaled_error=float(reals.sum_scaled_error) if adaptive else None,
            stiffness_index=float(reals.stiffness),
            largest_stiffness_index=float(reals.largest_stiffness),
            stability_limited=bool(counts.stability_limited),
            stability_limited_steps=int(counts.stability_limited_steps),
            switch_crossings=int(counts.crossings),
            residuals=int(counts.residuals),
            tangents=int(counts.tangents),
            solves=int(counts.solves),
            iterations=int(counts.iterations),
            approximate_tangents=int(counts.laws_tangents),
        )

    @property
    def missed_condition(self) -> tuple[int, float] | None:
        """First event or switch that may have been missed: (index, time in s), or None.

        Indices of switches follow those of the events.
        """
        counts = self._run.count
        return (
            (int(counts.unseen), float(self._run.real.unseen_time)) if counts.unseen >= 0 else None
        )

    @property
    def chatter(self) -> tuple[int, float] | None:
        """Last switch no longer watched because it chattered: (index, time in s), or None."""
        counts = self._run.count
        return (
            (int(counts.chatter), float(self._run.real.chatter_time))
            if counts.chatter >= 0
            else None
        )

    def accepts(self, samples: Samples) -> bool:
        """True if the rows of `samples` have the sizes of this run."""
        return samples.y.shape[1:] == (self._system.n_state,) and samples.memory.shape[1:] == (
            self._system.n_memory,
        )

    @property
    def event(self) -> int:
        """Index of the event that fired last; -1 for none."""
        return int(self._run.count.event)

    def message(
        self,
        components: Sequence[str] | None = None,
        events: Sequence[str] | None = None,
        cause: str = "",
    ) -> str:
        """Status as a sentence.

        Args:
            components: a name per component of y.
            events: a name per event.
            cause: known cause of a failure, "" if unknown.
        """
        failure = self.failure
        if self.pole is not None and self.status is Status.POLE:
            cause = self.pole[1]
        if failure is None:
            event = _name("event", self.event, events)
            return {
                Status.FINISHED: f"finished at t = {self.t:.9g} s",
                Status.STOPPED: f"stopped by {event} at t = {self.t:.9g} s",
            }.get(self.status, f"running, t = {self.t:.9g} s")
        return (
            failure_text(failure, components, events, cause, self.tableau.implicit)
            + f"; last good state at t = {self.t:.9g} s"
        )

    def state(self) -> dict[str, Array | Integers]:
        """State of the run as plain arrays {"real", "integer"}, from which it can be continued.

        A new process with the same problem continues bit for bit; samples are not part of it.
        """
        real = np.zeros(self._lib.mstmm_run_pack_reals(self._run))
        integer = np.zeros(self._lib.mstmm_run_pack_integers(self._run), dtype=np.int64)
        self._lib.mstmm_run_pack(
            self._run,
            self._ffi.from_buffer("double[]", real),
            self._ffi.from_buffer("int64_t[]", integer),
        )
        return {"real": real, "integer": integer}

    def restore(self, state: Mapping[str, Array | Integers]) -> None:
        """Restore a state that `state()` returned.  Samples not yet taken are lost.

        Raises:
            SceneError: if the state belongs to a run of other sizes or another method.
        """
        real = np.array(state["real"], dtype=np.float64)
        integer = np.array(state["integer"], dtype=np.int64)
        status = self._lib.mstmm_run_restore(
            self._run,
            len(real),
            self._ffi.from_buffer("double[]", real),
            len(integer),
            self._ffi.from_buffer("int64_t[]", integer),
        )
        self._samples = []
        if status:
            raise SceneError("the saved state belongs to another scene, method or version")


def _name(kind: str, index: int, names: Sequence[str] | None) -> str:
    return names[index] if names is not None and 0 <= index < len(names) else f"{kind} {index}"


def failure_text(
    fail: Failure,
    components: Sequence[str] | None = None,
    events: Sequence[str] | None = None,
    cause: str = "",
    implicit: bool = False,
) -> str:
    """Message for a failure, with a remedy that suits the kind of method, if there is one.

    Names as in `Integrator.message`.
    """
    component_name = _name(
        "component", -1 if fail.component is None else fail.component, components
    )
    event = _name("event", -1 if fail.event is None else fail.event, events)
    time_text = f"at t = {fail.time:.9g} s"
    cause_guess = "jump there" if implicit else "too stiff for an explicit method"
    problem = "fast" if implicit else "stiff"
    texts = {
        Status.STEP_TOO_SMALL: f"step too small {time_text}: {component_name} has the largest "
        f"error; "
        + (cause or f"the motion may be singular or {cause_guess}, or the tolerance too tight"),
        Status.NOT_FINITE: f"not finite {time_text}: {component_name}; "
        + (cause or "a smaller step or tolerance may help"),
        Status.RHS_FAILED: f"the equations of motion cannot be evaluated {time_text} (code "
        f"{fail.code})",
        Status.ACCEPT_FAILED: f"the state cannot be accepted {time_text} (code {fail.code})"
        + (f"; {cause}" if cause else ""),
        Status.EVENT_FAILED: f"an event condition cannot be evaluated {time_text} (code "
        f"{fail.code})"
        if fail.code
        else f"the condition of {event} is not a number {time_text}",
        Status.FIRE_FAILED: f"{event} failed {time_text} (code {fail.code})",
        Status.TOO_MANY_STEPS: f"more steps than allowed {time_text}"
        if not fail.code
        else f"no end in sight {time_text}: with the last step lengths the run would need more "
        "than 1e10 steps; the motion sticks where the right-hand side jumps, or is too "
        f"{problem} for the tolerance; max_steps, if given, is the only limit",
        Status.TANGENT_FAILED: f"the equations of motion have no regular tangent {time_text} (code "
        f"{fail.code}): the motion may be singular there, or leave an unstable position faster "
        "than the step allows; " + (cause or "a smaller step may help")
        if fail.code
        else f"a step from t = {fail.time:.9g} s would lose its fastest motion to rounding; use a "
        "shorter step, or check whether a stiffness or damping is far too large",
        Status.NOT_CONVERGED: f"Newton's iteration does not converge {time_text}: "
        f"{component_name} still changes; "
        + (cause or "a smaller step, or a Rosenbrock method such as rodas4p2, may help"),
        Status.LET_THROUGH: f"{event} holds, and the motion continues into it {time_text}: a "
        f"bounce "
        "reverses an approaching motion but supports nothing at rest; a resting contact needs a "
        "stop with stiffness (law.limits with a stiffness)",
        Status.POLE: f"a pole {time_text}: {cause}",
        Status.EVENT_CHATTER: f"{event} fires without end {time_text}",
        Status.BAD_ARGUMENT: f"check {_ARGUMENT_CHECKS.get(fail.code, 'the arguments')}",
    }
    return texts[fail.status]
