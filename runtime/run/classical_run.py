"""Run by the classical discrete-time transfer matrix method, in absolute coordinates.

The C code of `runtime/classical/c/` multiplies the element matrices of Rui, Wang, Zhang (Wiley
2019, ch. 7 and 8) along chains and branches, or eliminates them by a Riccati sweep.  The resulting
motion is converted to the coordinates of the scene's hinges.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ..classical.body_parts import Part, build_parts
from ..classical.c_records import Stepper, scene_size
from ..classical.planar_and_spatial import Form, PartMovement, select_form
from ..classical.state_conversion import StateConversion, start_movements
from ..integrate.c_loop import Samples, Statistics, Status
from ..integrate.settings import Settings
from ..integrate.steppers.alpha_family import parse_scheme
from ..packing.expansion import HELD
from ..packing.scene_packing import reject_loops, reject_qr_steps
from ..platform_support.interrupts import record_interrupts
from .integration_run import MAX_SAMPLE_BYTES, SLICE, split
from .scene_system import SceneSystem
from .trajectory import Trajectory

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

#: Method of `simulate` -> whether it multiplies the matrices; otherwise a Riccati sweep.
METHODS = {"dttmm-classical": False, "dttmm-classical-product": True}

#: A remaining time up to this part of a step is rounding and needs no step.
_REMAINDER = 1e-9

#: Largest number of doubles in the motions of one slice of steps.
_MAX_SLICE_SIZE = 2**19


def integrate(
    model: CompiledScene,
    settings: Settings,
    q: Array,
    u: Array,
    report_time: Callable[[float], None],
) -> Trajectory:
    """Run the model from (nq,), (nu,).

    `report_time` receives the reached time in s.  Raises SceneError without a step, and for
    elements that the method has no matrices for.
    """
    if settings.step is None:
        raise SceneError(f'method "{settings.method}" takes fixed steps: give step in s')
    for controller in model.scene.controller:
        raise SceneError(
            f'controller "{controller.name}": method "{settings.method}" does not support sampled '
            "controllers; use another method, such as dop853"
        )
    parse_scheme(settings.scheme)
    reject_loops(
        model.packed_scene, f'method "{settings.method}"',
        "its sources state it for chains and trees alone; genalpha and rodas4p2 do",
    )  # fmt: skip
    reject_qr_steps(model.packed_scene)
    return _Run(model, settings, report_time).run(q, u)


def reject_classical_options(settings: Settings) -> None:
    """Raise SceneError if options of the classical method are given with another method."""
    if settings.scheme or settings.iterations != 1:
        raise SceneError(
            f'method "{settings.method}" takes neither scheme nor iterations; they are for '
            f"{' and '.join(METHODS)}"
        )


@dataclass
class _SampleBuffer:
    """Samples so far: times, rows of q, u and work, and memory."""

    t: list[Array] = field(default_factory=list)
    y: list[Array] = field(default_factory=list)
    memory: list[Array] = field(default_factory=list)
    bytes: int = 0

    def add(self, t: Array, y: Array, memory: Array) -> None:
        self.t.append(t)
        self.y.append(y)
        self.memory.append(memory)
        self.bytes += t.nbytes + y.nbytes + memory.nbytes


class _Run:
    def __init__(
        self, model: CompiledScene, settings: Settings, report_time: Callable[[float], None]
    ) -> None:
        self.engine, self.settings, self.report_time = model.unmerged_engine, settings, report_time
        self.system = SceneSystem(self.engine)
        self.nq, self.nu = self.engine.nq, self.engine.nu
        self.samples, self.steps = _SampleBuffer(), 0
        self.memory, self._power = self.engine.start_memory(), 0.0  # at the last step
        step = settings.step or 0.0
        span = settings.t_end - settings.t_start
        self.step_count = ceil(span / step - _REMAINDER) if span > 0 else 0

    def run(self, q: Array, u: Array) -> Trajectory:
        settings, y = self.settings, self.system.start(self.settings.t_start, q, u)
        q, u = y[: self.nq].copy(), y[self.nq : self.nq + self.nu].copy()
        start_time, memory = np.array([settings.t_start]), self.memory[None]
        self.t, self.last = settings.t_start, self._rows(start_time, q[None], u[None], memory)[0]
        status: Status | None
        try:
            scheme = parse_scheme(settings.scheme)
            parts = build_parts(self.engine.packed)
            movements = start_movements(self.engine, parts, settings.t_start, q, u)
            form = self._form(parts, movements)
            start = np.array(
                [form.initial_motion(k, movement) for k, movement in enumerate(movements)]
            )
            product = METHODS[settings.method]
            self.stepper = Stepper(
                self.engine, parts, form, scheme, start, settings.iterations, product
            )
            self.states, self.parts = StateConversion(self.engine.packed, parts, form, q), parts
            self.memory = self.states.memory
            self._store_samples(start_time, self.last[None], self.memory[None], first=True)
            status, message = self._advance()
        except NumericalFailure as failure:
            status = Status.RHS_FAILED
            message = f"{failure}; last good state at t = {self.t:.9g} s"
        return self._trajectory(status, message)

    def _form(self, parts: Sequence[Part], movements: Sequence[PartMovement]) -> Form:
        names = [self._body_name(part.hinge) for part in parts]
        gravity = np.array(self.engine.packed.system.gravity)
        return select_form(parts, movements, gravity, names, scene_size(parts))

    def _body_name(self, hinge: int) -> str:
        """Name of the outboard body of a hinge."""
        return self.engine.body_name(hinge).removesuffix(f"/{HELD}")

    def _advance(self) -> tuple[Status | None, str]:
        """Run to the end in slices of steps; interrupts take effect between slices.

        Returns the status, None for interrupted, and a message.
        """
        count, settings = 1, self.settings
        max_count = max(1, _MAX_SLICE_SIZE // max(1, self.stepper.motions.size))
        with record_interrupts() as interrupted:
            while self.steps < self.step_count:
                allowed = settings.max_steps - self.steps if settings.max_steps else count
                if allowed <= 0:
                    return Status.TOO_MANY_STEPS, self._with_time("more steps than allowed")
                slice_start = time.monotonic()
                count_left = self.step_count - self.steps - 1
                failure = self._run_slice(max(1, min(count, allowed, count_left)))
                self.report_time(self.t)
                if failure:
                    return failure
                if interrupted:
                    return None, f"interrupted at t = {self.t:.9g} s"
                if self.samples.bytes > MAX_SAMPLE_BYTES:
                    return (
                        None,
                        f"{self._with_time('the samples fill the memory')}; give output times",
                    )
                if time.monotonic() - slice_start < SLICE / 2:
                    count = min(2 * count, max_count)
        return Status.FINISHED, f"finished at t = {self.t:.9g} s"

    def _run_slice(self, count: int) -> tuple[Status, str] | None:
        """Make `count` steps; the run's last step ends at t_end.  Returns a failure, else None."""
        settings, done = self.settings, self.steps
        step = settings.step or 0.0
        if done + 1 == self.step_count:
            step = settings.t_end - self.t
        motions = self.stepper.advance(count, step)
        self.steps += len(motions)
        step_numbers = np.arange(done + 1, self.steps + 1, dtype=np.float64)
        times: Array = settings.t_start + (settings.step or 0.0) * step_numbers
        if self.steps == self.step_count and len(times):
            times[-1] = settings.t_end
        if len(motions):
            q, u, memory = self.states.convert(motions)
            rows = self._rows(times, q, u, memory)
            self._store_samples(times, rows, memory)
            self.t, self.last, self.memory = float(times[-1]), rows[-1], memory[-1]
        return None if len(motions) == count else self._failure()

    # --- rows and samples ----------------------------------------------------------------------

    def _rows(self, times: Array, q: Array, u: Array, memory: Array) -> Array:
        """State rows (n, nq + nu), with a column of work by the trapezoidal rule if integrated."""
        if not self.system.has_power:
            return np.hstack([q, u])
        power = self._powers(times, q, u, memory)
        if self.steps:
            nodes, work = np.append(self.t, times), float(self.last[-1])
            increments = np.diff(nodes) * (np.append(self._power, power[:-1]) + power) / 2
        else:
            work, increments = 0.0, np.zeros(len(times))
        self._power = float(power[-1])
        return np.hstack([q, u, (work + np.cumsum(increments))[:, None]])

    def _powers(self, t: Array, q: Array, u: Array, memory: Array) -> Array:
        return np.asarray(self.engine.observe(t, q, u, memory, parts=("sums",)).sums[:, 3])

    def _store_samples(self, t: Array, rows: Array, memory: Array, first: bool = False) -> None:
        """Store every step, or the output times within these steps."""
        if self.settings.output_times is None:
            self.samples.add(t, rows, memory)
            return
        output_times = np.asarray(self.settings.output_times)
        if first:
            at_start = output_times == t[0]
            count = int(at_start.sum())
            self.samples.add(output_times[at_start], np.repeat(rows, count, axis=0), memory[:count])
            return
        inner = output_times[(output_times > self.t) & (output_times <= t[-1])]
        if len(inner):
            step_times, step_rows = np.append(self.t, t), np.vstack([self.last[None], rows])
            step_memory = np.vstack([self.memory[None], memory])
            inner_memory = step_memory[np.searchsorted(step_times, inner)]
            inner_rows = self._interpolate(inner, step_times, step_rows, step_memory)
            self.samples.add(inner, inner_rows, inner_memory)

    def _interpolate(self, output_times: Array, t: Array, rows: Array, memory: Array) -> Array:
        """State rows at output times, by cubic Hermite interpolation of states and rates."""
        right = np.searchsorted(t, output_times)
        ends = np.unique(np.concatenate([right - 1, right]))
        slopes = np.zeros_like(rows)
        slopes[ends] = self._slopes(t[ends], rows[ends], memory[ends])
        h = t[right] - t[right - 1]
        x = ((output_times - t[right - 1]) / h)[:, None]
        y0, y1 = rows[right - 1], rows[right]
        change, h = y1 - y0, h[:, None]
        bend_0, bend_1 = h * slopes[right - 1] - change, change - h * slopes[right]
        y = y0 + x * change + x * (1 - x) * ((1 - x) * bend_0 + x * bend_1)
        return np.where(x == 1.0, y1, y)

    def _slopes(self, t: Array, rows: Array, memory: Array) -> Array:
        q = np.ascontiguousarray(rows[:, : self.nq])
        u = np.ascontiguousarray(rows[:, self.nq : self.nq + self.nu])
        parts = list(self.engine.accelerations(t, q, u, memory))
        if self.system.has_power:
            parts.append(self._powers(t, q, u, memory)[:, None])
        return np.hstack(parts)

    # --- end of the run ------------------------------------------------------------------------

    def _with_time(self, text: str) -> str:
        at = f"t = {self.t:.9g} s"
        return f"{text} at {at}; last good state at {at}"

    def _failure(self) -> tuple[Status, str]:
        lib, run, engine = self.engine.lib, self.stepper.run, self.engine
        hinge = self.parts[int(run.element)].hinge
        hinge_text = f'hinge "{engine.hinge_name(hinge)}"'
        body_text = f'body "{self._body_name(hinge)}"'
        cause, remedy = _failure_cause(lib, int(run.failure), hinge_text, body_text)
        not_finite = run.failure == lib.MSTMM_CLASSICAL_NOT_FINITE
        text = f"{cause}, in the step from t = {self.t:.9g} s on; {remedy}"
        return Status.NOT_FINITE if not_finite else Status.RHS_FAILED, text

    def _trajectory(self, status: Status | None, message: str) -> Trajectory:
        n_memory, buffer = int(self.system.system.n_memory), self.samples
        t = np.concatenate([np.zeros(0), *buffer.t])
        y = np.concatenate([np.zeros((0, len(self.last))), *buffer.y])
        memory = np.concatenate([np.zeros((0, len(self.memory))), *buffer.memory])[:, :n_memory]
        samples = Samples(t, y, memory, np.zeros(len(t), dtype=np.int64))
        step = self.settings.step if self.step_count > 1 else None
        solutions = int(self.stepper.run.solutions) if hasattr(self, "stepper") else 0
        statistics = Statistics(
            self.steps, 0, solutions, 0, step, step, None, None, 0.0, 0.0, False, 0
        )
        return split(
            self.system, samples, self.settings, status, message, statistics, (self.t, self.last)
        )


def _failure_cause(lib: Any, failure: int, hinge: str, body: str) -> tuple[str, str]:
    """Cause and remedy of a failed step; `hinge` and `body` name the failing element."""
    return {
        lib.MSTMM_CLASSICAL_SINGULAR: (
            f"{hinge}: its motion is undetermined", "give the outboard bodies mass and inertia",
        ),
        lib.MSTMM_CLASSICAL_LOST: (
            f"the product of transfer matrices is lost to rounding: loads remain at the free end "
            f"of {body} (errors grow geometrically along a chain)",
            "use method dttmm-classical",
        ),
        lib.MSTMM_CLASSICAL_OPEN: (
            f"{hinge} has a position gap: constraint loads at position level oscillate and grow "
            "with an undamped scheme or a long step",
            "use generalised-alpha or a shorter step",
        ),
        lib.MSTMM_CLASSICAL_UNSETTLED: (
            "the iterations of a step do not converge", "use a shorter step"
        ),
        lib.MSTMM_CLASSICAL_FAR: (
            f"one linear solution moves {body} by more than the size of the scene, because the "
            "steps do not resolve a fast motion",
            "use iterations, a damped scheme or a shorter step",
        ),
        lib.MSTMM_CLASSICAL_NOT_FINITE: (
            f"the motion of {body} is not finite", "use a shorter step or a damped scheme"
        ),
    }[failure]  # fmt: skip
