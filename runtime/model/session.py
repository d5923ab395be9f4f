"""A session: a simulation that the caller advances step by step, with inputs set in between."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy as shallow
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Never, Self

import numpy as np

from mstmm.array_validation import Array, finite_float, mapping_by_name
from mstmm.display import PublicMembers
from mstmm.errors import NumericalFailure, SceneError
from mstmm.risk import Risk, sentences
from mstmm.scene.validators.validation_messages import did_you_mean

from ..discontinuities.active_expressions import active_expressions
from ..engine.inputs import with_held_inputs, with_input_values
from ..engine.looped_engine import LoopedEngine
from ..integrate.c_loop import Integrator, Samples, Status
from ..integrate.settings import Settings
from ..integrate.steppers import AUTO
from ..result.one_way.result import result_of
from ..run import classical_run, external_integrators
from ..run.integration_run import SLICE, make_run, needs_projection, project_samples, split
from ..run.measured_quantities import MeasuredOutputs, reject_one_way
from ..run.run_execution import code_for_any_length
from ..run.run_messages import missed_switch_note, stop_message
from ..run.scene_system import SceneSystem
from ..run.step_stability import check_step

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..result.result import Result

#: Rows for samples; only events write them, and they are not read.
_SAMPLE_ROWS = 4
#: The time map covers this many ticks ahead at first, then as much as the time elapsed.
_LOOKAHEAD_TICKS = 64.0
#: Number of steps over which the stability of a fixed step is checked.
_CHECKED_STEPS = 1000


class Session(PublicMembers):
    """A run that the caller advances; created by `Model.session`.

    `advance` integrates over a tick with given inputs, which stay constant until changed.  With
    fixed steps and unchanged inputs the states are bit for bit those of one `simulate` with these
    steps on the same engine, for any ticks that are multiples of the step; other ticks shorten a
    step at their end.  Methods with adaptive steps end a step at every tick: their states agree
    within the tolerance.

    Attributes:
        model: the model at the start of the session.
        settings: method and steps.
    """

    member_groups: ClassVar[Mapping[str, str]] = {
        "State": "t q u state model settings",
        "Advance": "advance inputs stop_reason copy",
        "Results": "outputs result risks warnings",
    }

    def __init__(
        self,
        model: CompiledScene,
        settings: Settings,
        q: Array,
        u: Array,
        risks: tuple[Risk, ...] = (),
    ) -> None:
        check_method(settings)
        reject_one_way(model.packed_scene, "a session")
        self.model, self.settings, self._risks = model, settings, risks
        self._names = settable_inputs(model)
        self._packed = with_held_inputs(model.packed_scene, self._names, settings.t_start)
        self._code = code_for_any_length(model, settings)
        self._outputs: MeasuredOutputs | None = MeasuredOutputs(LoopedEngine(self._packed))
        self._start_run(q, u, -math.inf if self._packed.is_time_dependent else math.inf)

    def _start_run(self, q: Array, u: Array, reach: float) -> None:
        """Start the integrator at (q, u); its breaks are known up to `reach` (s)."""
        engine = LoopedEngine(self._packed)
        system = self._system = SceneSystem(engine, self._code)
        self._run: Integrator = make_run(system, self.settings, q, u, _SAMPLE_ROWS)
        self._needs_projection = needs_projection(engine)
        ffi, n = engine.ffi, len(self._names)
        self._indices = {name: k for k, name in enumerate(self._names)}
        self._new_inputs = ffi.new("double[]", list(self._input_values()) or [0.0])
        record = self._record = ffi.new("mstmm_session *")
        record.scene, record.run, record.reach = system.run, self._run.record, reach
        record.n, record.given = n, self._new_inputs
        self._input_memory = engine.pointer(self._input_values()) if n else ffi.NULL
        record.held = self._input_memory
        self._advance = engine.lib.mstmm_session_advance

    # --- advance --------------------------------------------------------------------------------

    def advance(self, dt: float, inputs: Mapping[str, float] | None = None) -> None:
        """Advance by `dt` (s, 0 or more) with constant `inputs`, given by name.

        Inputs stay constant until changed.  Raises SceneError, without any change, for an invalid
        time or input and after an event that has ended the session.  Raises NumericalFailure if the
        integration fails: the session is then at the last valid state, and may continue from there
        with other inputs.
        """
        if inputs:
            values, indices = self._new_inputs, self._indices
            try:
                for name in inputs:
                    values[indices[name]] = inputs[name]
            except (KeyError, IndexError, TypeError, ValueError, OverflowError):
                raise self._input_rejection(inputs) from None
        try:
            status = self._advance(self._record, dt, SLICE)
        except (TypeError, OverflowError):
            raise self._rejection(-1, dt) from None
        if status != Status.FINISHED:
            self._handle_status(status, dt)

    def _handle_status(self, status: int, dt: float) -> None:
        """Continue, or raise the error, after a call that did not reach its end."""
        lib = self._system.engine.lib
        while status in (Status.RUNNING, lib.MSTMM_UNMAPPED):
            if status == Status.RUNNING:  # Python handles interrupts between calls
                status = lib.mstmm_session_rest(self._record, SLICE)
            else:
                self._update_time_map(float(dt))
                status = self._advance(self._record, dt, SLICE)
        if status == lib.MSTMM_REFUSED:
            raise self._rejection(int(self._record.refused), dt)
        if status < 0:
            system = shallow(self._system)
            system.engine = self._current_model().looped  # for a message with the current inputs
            raise NumericalFailure(stop_message(system, self._run))

    def _rejection(self, index: int, dt: object) -> SceneError:
        """Error of a rejected call; new inputs are reset."""
        value = float(self._new_inputs[index]) if index >= 0 else 0.0
        self._reset_new_inputs()
        if index >= 0:
            return SceneError(f'inputs["{self._names[index]}"] = {value}: expected a finite number')
        if index == -1:
            return SceneError(f"dt = {dt!r}: expected a time in s, 0 or more")
        return SceneError(f"the session was {self.stop_reason}; make a new one, or copy it before")

    def _input_rejection(self, inputs: Any) -> SceneError:
        self._reset_new_inputs()
        for name, value in mapping_by_name("inputs", inputs).items():
            if name not in self._indices:
                return SceneError(unsettable_reason(self.model, name, self._names))
            finite_float(f'inputs["{name}"]', value)
        return SceneError(f"inputs = {inputs!r}: expected finite numbers by name")

    def _reset_new_inputs(self) -> None:
        for k, value in enumerate(self._input_values()):
            self._new_inputs[k] = value

    def _update_time_map(self, dt: float) -> None:
        """Compute breaks and short signals beyond the end of this tick."""
        start = self.t
        end = start + max(_LOOKAHEAD_TICKS * dt, start - self.settings.t_start)
        try:
            time_map = self._packed.time_map(start, end)
        except SceneError:
            self._reset_new_inputs()
            raise
        self._run.map_times(time_map.breaks, (time_map.starts, time_map.longest), time_map.pole)
        self._record.reach = end

    # --- current state --------------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Time, s."""
        return self._run.t

    @property
    def state(self) -> tuple[Array, Array]:
        """State (q (nq,), u (nu,)), as for `initial`."""
        y, nq = self._projected_state(), self.model.nq
        return y[:nq], y[nq : nq + self.model.nu]

    @property
    def q(self) -> Array:
        """Coordinates (nq,); m, rad, unit quaternions."""
        return self._projected_state()[: self.model.nq]

    @property
    def u(self) -> Array:
        """Speeds (nu,); m/s, rad/s."""
        nq = self.model.nq
        return self._projected_state()[nq : nq + self.model.nu]

    def _projected_state(self) -> Array:
        """State as in the samples of a result: projected onto the constraints."""
        y = self._run.y
        if not self._needs_projection:
            return y
        t = np.array([self.t])
        return project_samples(self._system, t, y[None], self._system.memory[None])[0][0]

    @property
    def risks(self) -> tuple[Risk, ...]:
        """Objections to the fixed step, and to conditions of events that may have been missed."""
        unseen_condition = self._run.missed_condition
        return (
            self._risks
            if unseen_condition is None
            else (*self._risks, missed_switch_note(self._system, *unseen_condition))
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Risks as sentences."""
        return sentences(self.risks)

    @property
    def inputs(self) -> dict[str, float]:
        """Current values of the inputs that can be set, by name."""
        return dict(zip(self._names, map(float, self._input_values()), strict=True))

    @property
    def stop_reason(self) -> str:
        """Reason why an event ended the session; "" while it runs."""
        return stop_message(self._system, self._run) if self._run.status is Status.STOPPED else ""

    def outputs(self) -> dict[str, Any]:
        """Outputs of the scene at the current state by name: numbers, or arrays for vectors."""
        if self._outputs is None:
            self._outputs = MeasuredOutputs(self._system.engine)
        values = self._outputs.evaluate(self._system.run, self.t, self._projected_state())
        if self._outputs.remaining_names:
            quantities = self.result().outputs()
            values |= {
                name: quantities[name][0]
                for name in self._outputs.remaining_names
                if name in quantities
            }
        return values

    def result(self) -> Result:
        """Current state as a result of one sample, with all quantities of the scene."""
        model, run = self._current_model(), self._run
        memory = self._system.memory[None, : model.packed_scene.system.n_memory].copy()
        samples = Samples(np.array([run.t]), run.y[None], memory, np.zeros(1, dtype=np.int64))
        settings = replace(self.settings, t_end=run.t, output_times=None)
        trajectory = split(
            self._system, samples, settings, Status.FINISHED, stop_message(self._system, run),
            run.statistics, (run.t, run.y),
        )  # fmt: skip
        return result_of(model, trajectory)

    def _input_values(self) -> Array:
        """Values of the inputs that can be set, a view of the memory."""
        memory, n = self._system.memory, len(self._names)
        return memory[len(memory) - n :]

    def _current_model(self) -> CompiledScene:
        """Model with the current inputs."""
        return self.model.with_packed_scene(with_input_values(self.model.packed_scene, self.inputs))

    def copy(self) -> Self:
        """Independent session at the same state, with the same settings and inputs."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__, _outputs=None)
        other._start_run(self.q, self.u, float(self._record.reach))
        other._run.take_over(self._run)
        other._reset_new_inputs()
        return other

    __copy__ = copy

    def __deepcopy__(self, _: object) -> Self:
        return self.copy()

    def __reduce__(self) -> Never:
        raise SceneError(
            "sessions cannot be pickled; pickle model, t and state, and start another one with "
            "model.session(q, u, t)"
        )

    def __repr__(self) -> str:
        return f"<Session: t = {self.t:.9g} s{self.stop_reason and ', '}{self.stop_reason}>"


def step_risks(model: CompiledScene, settings: Settings, q: Array, u: Array) -> tuple[Risk, ...]:
    """Objections to a fixed step of a session that starts at q (nq,), u (nu,)."""
    check_method(settings)
    assert settings.step is not None
    long_run = replace(settings, t_end=settings.t_start + _CHECKED_STEPS * settings.step)
    check = check_step(model.looped, long_run, q, u)
    return () if check is None or check.risk is None else (check.risk,)


def check_method(settings: Settings) -> None:
    """Raise SceneError for methods that only make whole runs."""
    if settings.method in (AUTO, *external_integrators.METHODS, *classical_run.METHODS):
        raise SceneError(
            f'method "{settings.method}" only makes whole runs: use simulate, or a method for '
            "sessions such as rk4 (with step), dop853, rodas5p or genalpha"
        )


def settable_inputs(model: CompiledScene) -> tuple[str, ...]:
    """Names of the inputs that can be set during a session.

    Without those that drive coordinates, are set by a controller, or depend on time.
    """
    drives = [active for active in active_expressions(model.scene) if active.drive]
    drive_inputs = {name for active in drives for name in active.inputs}
    time_dependent = {
        name for name, number in model.packed_scene.channels.items() if not number.is_constant
    }
    excluded = {*drive_inputs, *model.scene.controllers_by_input, *time_dependent}
    return tuple(entry.name for entry in model.scene.input if entry.name not in excluded)


def unsettable_reason(model: CompiledScene, name: str, names: Sequence[str]) -> str:
    """Message why an input cannot be set during a session."""
    if name in model.scene.controllers_by_input:
        controller = model.scene.controllers_by_input[name]
        return f'inputs["{name}"]: controller "{controller}" sets this input'
    for active in active_expressions(model.scene):
        if (
            active.drive
            and name in active.inputs
            and any(i.name == name for i in model.scene.input)
        ):
            return (
                f'inputs["{name}"]: the {active.description} follows this input, and a jump '
                "of a drive is an impact; set its rates or a signal before the session, by "
                "with_inputs"
            )
    if any(entry.name == name for entry in model.scene.input):
        return (
            f'inputs["{name}"]: this input depends on time, by a signal or by its rates; give it a '
            "number before the session, by with_inputs, to set it"
        )
    return f'inputs["{name}"]: there is no such input in the scene{did_you_mean(name, names)}'
