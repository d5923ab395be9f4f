"""A session: a model that is taken forward tick by tick, its inputs set in between."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy as shallow
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Never, Self

import numpy as np

from mstmm.array_validation import Array, finite_float, mapping_by_name
from mstmm.errors import NumericalFailure, SceneError
from mstmm.risk import Risk, sentences
from mstmm.scene.validators.validation_messages import did_you_mean

from ..discontinuities.active_expressions import active_expressions
from ..engine.input_update import with_held_inputs, with_input_values
from ..engine.looped_engine import LoopedEngine
from ..integrate.c_loop import Integrator, Samples, Status
from ..integrate.settings import Settings
from ..integrate.steppers import AUTO
from ..result.factory import result_of
from ..run import classical_run, external_integrators
from ..run.engine_choice import for_many
from ..run.integration_run import SLICE, make_run, project_samples, settles, split
from ..run.measured_quantities import MeasuredOutputs, refuse_one_way
from ..run.run_notes import unseen
from ..run.scene_system import SceneSystem
from ..run.step_stability import check_step
from ..run.stop_messages import message_of

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..result.result import Result

#: Rows for samples, which only events leave and nobody reads.
_ROWS = 4
#: Known times reach so many ticks ahead at first, then as far again as the session has come.
_AHEAD = 64.0
#: Steps over which a motion that a fixed step makes grow is taken to show.
_MANY = 1000


class Session:
    """A run in the caller's hands, made by `Model.session`.

    `advance` goes on in time under the inputs it is given, which stay what they are until they are
    given anew.  With fixed steps and unchanged inputs the states are bit for bit those of one
    `simulate` with these steps on the same engine, however the time is cut; where a tick ends
    between two steps the step is cut there, as at a break.  Methods that choose their steps end one
    at every tick: their states agree within the tolerance.

    Attributes:
        model: the model at the session's start.
        settings: how its steps are made.
    """

    def __init__(
        self,
        model: CompiledScene,
        settings: Settings,
        q: Array,
        u: Array,
        risks: tuple[Risk, ...] = (),
    ) -> None:
        refuse_method(settings)
        refuse_one_way(model.packed, "a session")
        self.model, self.settings, self._risks = model, settings, risks
        self._names = settable(model)
        self._packed = with_held_inputs(model.packed, self._names, settings.t_start)
        self._code = for_many(model, settings)
        self._outputs: MeasuredOutputs | None = MeasuredOutputs(LoopedEngine(self._packed))
        self._make(q, u, -math.inf if self._packed.goes_by_time else math.inf)

    def _make(self, q: Array, u: Array, reach: float) -> None:
        """A run that starts; before `reach` (s) its breaks are known."""
        engine = LoopedEngine(self._packed)
        system = self._system = SceneSystem(engine, self._code)
        self._run: Integrator = make_run(system, self.settings, q, u, _ROWS)
        self._settles = settles(engine)
        ffi, n = engine.ffi, len(self._names)
        self._places = {name: k for k, name in enumerate(self._names)}
        self._given = ffi.new("double[]", list(self._held()) or [0.0])
        record = self._record = ffi.new("mstmm_session *")
        record.scene, record.run, record.reach = system.run, self._run.record, reach
        record.n, record.given = n, self._given
        self._memory = engine.pointer(self._held()) if n else ffi.NULL
        record.held = self._memory
        self._advance = engine.lib.mstmm_session_advance

    # --- on in time -----------------------------------------------------------------------------

    def advance(self, dt: float, inputs: Mapping[str, float] | None = None) -> None:
        """On by `dt` (s, 0 or more) with `inputs` at these numbers from now on, by their names.

        Raises SceneError, with nothing changed, for a time or an input that makes no sense and
        behind an event that has ended the session.  NumericalFailure where the motion ends: the
        session then stands at the last good state, and may go on from there with other inputs.
        """
        if inputs:
            given, places = self._given, self._places
            try:
                for name in inputs:
                    given[places[name]] = inputs[name]
            except (KeyError, IndexError, TypeError, ValueError, OverflowError):
                raise self._refused_input(inputs) from None
        try:
            status = self._advance(self._record, dt, SLICE)
        except (TypeError, OverflowError):
            raise self._refused(-1, dt) from None
        if status != Status.FINISHED:
            self._otherwise(status, dt)

    def _otherwise(self, status: int, dt: float) -> None:
        """What there is to do where a call did not simply reach its end."""
        lib = self._system.engine.lib
        while status in (Status.RUNNING, lib.MSTMM_UNMAPPED):
            if status == Status.RUNNING:  # between two of these Python looks for interrupts
                status = lib.mstmm_session_rest(self._record, SLICE)
            else:
                self._look_ahead(float(dt))
                status = self._advance(self._record, dt, SLICE)
        if status == lib.MSTMM_REFUSED:
            raise self._refused(int(self._record.refused), dt)
        if status < 0:
            raise NumericalFailure(self._failure())

    def _refused(self, which: int, dt: object) -> SceneError:
        """Why nothing was done; what was given is forgotten."""
        value = float(self._given[which]) if which >= 0 else 0.0
        self._forget_given()
        if which >= 0:
            return SceneError(f'inputs["{self._names[which]}"] = {value}: expected a finite number')
        if which == -1:
            return SceneError(f"dt = {dt!r}: expected a time in s, 0 or more")
        return SceneError(f"the session was {self.stopped}; make a new one, or keep a copy before")

    def _refused_input(self, inputs: Any) -> SceneError:
        self._forget_given()
        for name, value in mapping_by_name("inputs", inputs).items():
            if name not in self._places:
                return SceneError(not_settable(self.model, name, self._names))
            finite_float(f'inputs["{name}"]', value)
        return SceneError(f"inputs = {inputs!r}: expected finite numbers by their names")

    def _forget_given(self) -> None:
        for k, value in enumerate(self._held()):
            self._given[k] = value

    def _failure(self) -> str:
        """How the motion ended, told with the inputs as they are."""
        system = shallow(self._system)
        system.engine = self._now().looped
        return message_of(system, self._run)

    def _look_ahead(self, dt: float) -> None:
        """Finds the times that steps have to look out for, up to behind the end of this tick."""
        start = self.t
        end = start + max(_AHEAD * dt, start - self.settings.t_start)
        try:
            known = self._packed.time_map(start, end)
        except SceneError:
            self._forget_given()
            raise
        self._run.map_times(known.breaks, (known.starts, known.longest), known.pole)
        self._record.reach = end

    # --- where it is ----------------------------------------------------------------------------

    @property
    def t(self) -> float:
        """The time, s."""
        return self._run.t

    @property
    def state(self) -> tuple[Array, Array]:
        """(nq,), (nu,): both `q` and `u`, as `initial` takes them."""
        y, nq = self._state(), self.model.nq
        return y[:nq], y[nq : nq + self.model.nu]

    @property
    def q(self) -> Array:
        """(nq,) hinge coordinates; m, rad, unit quaternions."""
        return self._state()[: self.model.nq]

    @property
    def u(self) -> Array:
        """(nu,) hinge speeds; m/s, rad/s."""
        nq = self.model.nq
        return self._state()[nq : nq + self.model.nu]

    def _state(self) -> Array:
        """The state as the samples of a result have it."""
        y = self._run.y
        if not self._settles:
            return y
        t = np.array([self.t])
        return project_samples(self._system, t, y[None], self._system.memory[None])[0][0]

    @property
    def risks(self) -> tuple[Risk, ...]:
        """What speaks against the fixed step; conditions that may have held unseen."""
        missed = self._run.unseen
        return self._risks if missed is None else (*self._risks, unseen(self._system, *missed))

    @property
    def warnings(self) -> tuple[str, ...]:
        """The risks, one sentence each."""
        return sentences(self.risks)

    @property
    def inputs(self) -> dict[str, float]:
        """What the inputs that can be set are now, by their names."""
        return dict(zip(self._names, map(float, self._held()), strict=True))

    @property
    def stopped(self) -> str:
        """How an event ended the session, in words; "" while it goes on."""
        return message_of(self._system, self._run) if self._run.status is Status.STOPPED else ""

    def outputs(self) -> dict[str, Any]:
        """The outputs of the scene at this state, by their names: numbers, or arrays of vectors."""
        if self._outputs is None:
            self._outputs = MeasuredOutputs(self._system.engine)
        found = self._outputs.at(self._system.run, self.t, self._state())
        if self._outputs.others:
            shown = self.result().outputs()
            found |= {name: shown[name][0] for name in self._outputs.others if name in shown}
        return found

    def result(self) -> Result:
        """This state as a result of one sample, which knows every quantity of the scene."""
        model, run = self._now(), self._run
        memory = self._system.memory[None, : model.packed.system.n_memory].copy()
        samples = Samples(np.array([run.t]), run.y[None], memory, np.zeros(1, dtype=np.int64))
        settings = replace(self.settings, t_end=run.t, output_times=None)
        found = split(
            self._system, samples, settings, Status.FINISHED, message_of(self._system, run),
            run.statistics, (run.t, run.y),
        )  # fmt: skip
        return result_of(model, found)

    def _held(self) -> Array:
        """What the inputs that can be set are."""
        memory, n = self._system.memory, len(self._names)
        return memory[len(memory) - n :]

    def _now(self) -> CompiledScene:
        """The model under the inputs of now."""
        return self.model.renewed(with_input_values(self.model.packed, self.inputs))

    def copy(self) -> Self:
        """A session of its own that stands where this one does, and goes on alike."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__, _outputs=None)
        other._make(self.q, self.u, float(self._record.reach))
        other._run.take_over(self._run)
        other._forget_given()
        return other

    __copy__ = copy

    def __deepcopy__(self, _: object) -> Self:
        return self.copy()

    def __reduce__(self) -> Never:
        raise SceneError(
            "a session stays in its process and is not pickled; keep its model, t and state, and "
            "begin another with model.session(q, u, t)"
        )

    def __repr__(self) -> str:
        return f"<Session: t = {self.t:.9g} s{self.stopped and ', '}{self.stopped}>"


def step_risks(model: CompiledScene, settings: Settings, q: Array, u: Array) -> tuple[Risk, ...]:
    """What speaks against a fixed step over as many as a session will make, from (nq,), (nu,)."""
    refuse_method(settings)
    assert settings.step is not None
    long = replace(settings, t_end=settings.t_start + _MANY * settings.step)
    found = check_step(model.looped, long, q, u)
    return () if found is None or found.risk is None else (found.risk,)


def refuse_method(settings: Settings) -> None:
    """SceneError for methods that make whole runs."""
    if settings.method in (AUTO, *external_integrators.METHODS, *classical_run.METHODS):
        raise SceneError(
            f'method "{settings.method}" makes whole runs: use simulate, or for a session a method '
            "such as rk4 (with step), dop853, rodas5p or genalpha"
        )


def settable(model: CompiledScene) -> tuple[str, ...]:
    """The inputs that may be set while a model moves: those that nothing is driven by, that no
    controller sets, and that do not go by time."""
    driving = {name for one in active_expressions(model.scene) if one.drive for name in one.inputs}
    moving = {name for name, number in model.packed.channels.items() if not number.stands}
    taken = {*driving, *model.scene.controlled, *moving}
    return tuple(one.name for one in model.scene.input if one.name not in taken)


def not_settable(model: CompiledScene, name: str, names: Sequence[str]) -> str:
    """Why an input cannot be set while a model moves."""
    if name in model.scene.controlled:
        return f'inputs["{name}"]: controller "{model.scene.controlled[name]}" sets this input'
    for one in active_expressions(model.scene):
        if one.drive and name in one.inputs and any(i.name == name for i in model.scene.input):
            return (
                f'inputs["{name}"]: the {one.what} follows this input, and a drive that jumps is a '
                "blow; give it with its rates or as a signal before the session, by with_inputs"
            )
    if any(one.name == name for one in model.scene.input):
        return (
            f'inputs["{name}"]: this input goes by time, by a signal or by its rates; give it a '
            "number before the session, by with_inputs, to set it"
        )
    return f'inputs["{name}"]: there is no such input in the scene{did_you_mean(name, names)}'
