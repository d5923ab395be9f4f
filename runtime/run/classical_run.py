"""One run by the classical discrete-time transfer matrix method, in absolute coordinates.

Element matrices of Rui, Wang, Zhang (Wiley 2019, ch. 7 and 8) are multiplied along chains and by
branches, or eliminated after Riccati, by the C of `runtime/classical/c/`.  The motion that comes
out is turned into the coordinates of the scene's hinges.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ..classical.body_parts import Part, build_parts
from ..classical.c_records import Stepper, scene_size
from ..classical.failures import failure_message
from ..classical.integration_schemes import parse_scheme
from ..classical.planar_and_spatial import Form, PartMovement, select_form
from ..classical.state_conversion import StateConversion, start_movements
from ..integrate.c_loop import Samples, Statistics, Status
from ..integrate.settings import Settings
from ..packing.flexible.expansion import HELD
from ..packing.loops.unsupported_loops import reject_loops
from ..packing.qr_sweep import reject_qr_steps
from ..platform_support.interrupts import record_interrupts
from .integration_run import LARGEST, SLICE, split
from .scene_system import SceneSystem
from .trajectory import Trajectory

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

#: Method of `simulate` -> whether it multiplies the matrices; else Riccati on them.
METHODS = {"dttmm-classical": False, "dttmm-classical-product": True}

#: A rest of the run that is this part of a step, or less, is none.
_REST = 1e-9

#: Most numbers of one slice of motions.
_MOST = 2**19


def integrate(
    model: CompiledScene, settings: Settings, q: Array, u: Array, tell: Callable[[float], None]
) -> Trajectory:
    """One run.  Raises SceneError without a step, and for what there are no matrices for."""
    if settings.step is None:
        raise SceneError(f'method "{settings.method}" takes fixed steps: give step in s')
    for one in model.scene.controller:
        raise SceneError(
            f'controller "{one.name}": method "{settings.method}" has no samples; take another one'
        )
    parse_scheme(settings.scheme)
    reject_loops(
        model.packed, f'method "{settings.method}"',
        "its sources state it for chains and trees alone; genalpha and rodas4p2 do",
    )  # fmt: skip
    reject_qr_steps(model.packed)
    return _Run(model, settings, tell).run(q, u)


def refuse_options(settings: Settings) -> None:
    """SceneError for options of this method beside another one."""
    if settings.scheme or settings.iterations != 1:
        raise SceneError(
            f'method "{settings.method}" takes neither scheme nor iterations; they are for '
            f"{' and '.join(METHODS)}"
        )


@dataclass
class _Kept:
    """Samples so far: t, y rows of q, u and work, memory."""

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
        self, model: CompiledScene, settings: Settings, tell: Callable[[float], None]
    ) -> None:
        self.engine, self.settings, self.tell = model.apart, settings, tell
        self.system = SceneSystem(self.engine)
        self.nq, self.nu = self.engine.nq, self.engine.nu
        self.kept, self.steps = _Kept(), 0
        self.memory, self._power = self.engine.start_memory(), 0.0  # at the last step
        step = settings.step or 0.0
        span = settings.t_end - settings.t_start
        self.whole = ceil(span / step - _REST) if span > 0 else 0

    def run(self, q: Array, u: Array) -> Trajectory:
        settings, y = self.settings, self.system.start(self.settings.t_start, q, u)
        q, u = y[: self.nq].copy(), y[self.nq : self.nq + self.nu].copy()
        start_time, memory = np.array([settings.t_start]), self.memory[None]
        self.t, self.last = settings.t_start, self._rows(start_time, q[None], u[None], memory)[0]
        status: Status | None
        try:
            scheme = parse_scheme(settings.scheme)
            parts = build_parts(self.engine.packed)
            moving = start_movements(self.engine, parts, settings.t_start, q, u)
            form = self._form(parts, moving)
            start = np.array([form.start(k, at) for k, at in enumerate(moving)])
            product = METHODS[settings.method]
            self.stepper = Stepper(
                self.engine, parts, form, scheme, start, settings.iterations, product
            )
            self.states, self.parts = StateConversion(self.engine.packed, parts, form, q), parts
            self.memory = self.states.memory
            self._keep(start_time, self.last[None], self.memory[None], first=True)
            status, message = self._advance()
        except NumericalFailure as failure:
            status = Status.RHS_FAILED
            message = f"{failure}; last good state at t = {self.t:.9g} s"
        return self._trajectory(status, message)

    def _form(self, parts: Sequence[Part], moving: Sequence[PartMovement]) -> Form:
        names = [self._body(part.hinge) for part in parts]
        gravity = np.array(self.engine.packed.system.gravity)
        return select_form(parts, moving, gravity, names, scene_size(parts))

    def _body(self, place: int) -> str:
        """Name of the body behind a hinge."""
        return self.engine.body_name(place).removesuffix(f"/{HELD}")

    def _advance(self) -> tuple[Status | None, str]:
        """Slices of steps to the end; interrupts are heard between them."""
        count, settings = 1, self.settings
        most = max(1, _MOST // max(1, self.stepper.motions.size))
        with record_interrupts() as interrupted:
            while self.steps < self.whole:
                allowed = settings.max_steps - self.steps if settings.max_steps else count
                if allowed <= 0:
                    return Status.TOO_MANY_STEPS, self._at("more steps than allowed")
                began = time.monotonic()
                failed = self._slice(max(1, min(count, allowed, self.whole - self.steps - 1)))
                self.tell(self.t)
                if failed:
                    return failed
                if interrupted:
                    return None, f"interrupted at t = {self.t:.9g} s"
                if self.kept.bytes > LARGEST:
                    return None, f"{self._at('the samples fill the memory')}; ask for output times"
                if time.monotonic() - began < SLICE / 2:
                    count = min(2 * count, most)
        return Status.FINISHED, f"finished at t = {self.t:.9g} s"

    def _slice(self, count: int) -> tuple[Status, str] | None:
        """Steps, all whole but the run's last one; how they failed."""
        settings, done = self.settings, self.steps
        step = settings.step or 0.0
        if done + 1 == self.whole:
            step = settings.t_end - self.t
        motions = self.stepper.advance(count, step)
        self.steps += len(motions)
        numbers = np.arange(done + 1, self.steps + 1, dtype=np.float64)
        times: Array = settings.t_start + (settings.step or 0.0) * numbers
        if self.steps == self.whole and len(times):
            times[-1] = settings.t_end
        if len(motions):
            q, u, memory = self.states.of(motions)
            rows = self._rows(times, q, u, memory)
            self._keep(times, rows, memory)
            self.t, self.last, self.memory = float(times[-1]), rows[-1], memory[-1]
        return None if len(motions) == count else self._failure()

    # --- rows and samples ----------------------------------------------------------------------

    def _rows(self, times: Array, q: Array, u: Array, memory: Array) -> Array:
        """Rows of the integrator's state; the work by the trapezoidal rule over the steps."""
        if not self.system.with_power:
            return np.hstack([q, u])
        power = self._powers(times, q, u, memory)
        if self.steps:
            before, work = np.append(self.t, times), float(self.last[-1])
            gains = np.diff(before) * (np.append(self._power, power[:-1]) + power) / 2
        else:
            work, gains = 0.0, np.zeros(len(times))
        self._power = float(power[-1])
        return np.hstack([q, u, (work + np.cumsum(gains))[:, None]])

    def _powers(self, t: Array, q: Array, u: Array, memory: Array) -> Array:
        return np.asarray(self.engine.observe(t, q, u, memory, parts=("sums",)).sums[:, 3])

    def _keep(self, t: Array, rows: Array, memory: Array, first: bool = False) -> None:
        """Every step, or the output times in these steps by cubics."""
        wanted = self.settings.output_times
        if wanted is None:
            self.kept.add(t, rows, memory)
            return
        asked = np.asarray(wanted)
        if first:
            here = asked == t[0]
            count = int(here.sum())
            self.kept.add(asked[here], np.repeat(rows, count, axis=0), memory[:count])
            return
        here = asked[(asked > self.t) & (asked <= t[-1])]
        if len(here):
            times, all_rows = np.append(self.t, t), np.vstack([self.last[None], rows])
            known = np.vstack([self.memory[None], memory])
            nearest = known[np.searchsorted(times, here)]
            self.kept.add(here, self._between(here, times, all_rows, known), nearest)

    def _between(self, wanted: Array, t: Array, rows: Array, memory: Array) -> Array:
        """Rows at times between steps: cubics of the steps' states and rates; steps themselves."""
        right = np.searchsorted(t, wanted)
        ends = np.unique(np.concatenate([right - 1, right]))
        slopes = np.zeros_like(rows)
        slopes[ends] = self._slopes(t[ends], rows[ends], memory[ends])
        h = t[right] - t[right - 1]
        x = ((wanted - t[right - 1]) / h)[:, None]
        left, at = rows[right - 1], rows[right]
        change, h = at - left, h[:, None]
        before, after = h * slopes[right - 1] - change, change - h * slopes[right]
        found = left + x * change + x * (1 - x) * ((1 - x) * before + x * after)
        return np.where(x == 1.0, at, found)

    def _slopes(self, t: Array, rows: Array, memory: Array) -> Array:
        q = np.ascontiguousarray(rows[:, : self.nq])
        u = np.ascontiguousarray(rows[:, self.nq : self.nq + self.nu])
        parts = list(self.engine.accelerations(t, q, u, memory))
        if self.system.with_power:
            parts.append(self._powers(t, q, u, memory)[:, None])
        return np.hstack(parts)

    # --- how it ends ---------------------------------------------------------------------------

    def _at(self, text: str) -> str:
        at = f"t = {self.t:.9g} s"
        return f"{text} at {at}; last good state at {at}"

    def _failure(self) -> tuple[Status, str]:
        lib, run, engine = self.engine.lib, self.stepper.run, self.engine
        place = self.parts[int(run.element)].hinge
        hinge, body = f'hinge "{engine.hinge_name(place)}"', f'body "{self._body(place)}"'
        what, way_out = failure_message(lib, int(run.failure), hinge, body)
        not_finite = run.failure == lib.MSTMM_CLASSICAL_NOT_FINITE
        text = f"{what}, in the step from t = {self.t:.9g} s on; {way_out}"
        return Status.NOT_FINITE if not_finite else Status.RHS_FAILED, text

    def _trajectory(self, status: Status | None, message: str) -> Trajectory:
        n_memory, kept = int(self.system.system.n_memory), self.kept
        t = np.concatenate([np.zeros(0), *kept.t])
        y = np.concatenate([np.zeros((0, len(self.last))), *kept.y])
        memory = np.concatenate([np.zeros((0, len(self.memory))), *kept.memory])[:, :n_memory]
        samples = Samples(t, y, memory, np.zeros(len(t), dtype=np.int64))
        step = self.settings.step if self.whole > 1 else None
        statistics = Statistics(
            self.steps, 0, self._solutions(), 0, step, step, None, None, 0.0, 0.0, False, 0
        )
        return split(
            self.system, samples, self.settings, status, message, statistics, (self.t, self.last)
        )

    def _solutions(self) -> int:
        return int(self.stepper.run.solutions) if hasattr(self, "stepper") else 0
