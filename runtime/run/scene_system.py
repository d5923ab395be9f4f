"""C system of a packed scene, which the integrators advance in time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.abi.failure_codes import FailureCode
from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError
from mstmm.ir.tape import INSTRUCTION_WIDTH, OUTPUT_WIDTH, Tape
from mstmm.scene import Scene

from ..engine.inputs import IndexPairs, LiveInputs
from ..engine.looped_engine import LoopedEngine, Probe
from ..engine.tangent_matrix import TangentMatrix
from ..kernels.c_records import c_tape
from ..kernels.scene_libraries import FusedLibrary
from ..packing.coordinate_layout import StateNames
from ..packing.event_functions import MAX_SWITCHES, Bounce
from ..packing.packed_scene import hinges_released_by_time, resize_workspace
from ..packing.scene_packing import reject_qr_steps
from .measured_quantities import Controllers


@dataclass(frozen=True)
class SceneCode:
    """Fused code of a scene: for one state and for SIMD lanes of states, with its numbers.

    `inputs` are the indices of inputs in `numbers`.  `implicit` returns the code of residual and
    tangent for implicit methods, None without one.
    """

    scalar: FusedLibrary
    lanes: FusedLibrary | None
    numbers: Array
    inputs: IndexPairs
    implicit: Callable[[], FusedLibrary | None]


class SceneSystem:
    """`mstmm_system` of a model, with its own memory for events, power and turns.

    With `compiled` the right-hand side is fused code, while events and projection use the engine.
    Without `has_power` the work of non-conservative loads is not integrated.
    """

    def __init__(
        self, engine: LoopedEngine, compiled: SceneCode | None = None, with_power: bool = True
    ) -> None:
        packed, ffi = engine.packed, engine.ffi
        self.engine, self.keep_alive = engine, list[Any]()
        actions, self.event_names = _event_actions(engine)
        self.switches, self.uses_position_level = packed.event_functions.switches, False
        self.memory = engine.start_memory()
        model, system = packed.model, packed.system
        self.run = run = ffi.new("mstmm_scene_run *")
        run.model = model
        working = (
            system.laws, system.driven, system.loads, system.forces, system.couplings,
            packed.event_functions.bounces,
            *(body.D.any() or body.drag is not None for body in packed.flexible.values()),
        )  # fmt: skip
        run.with_power = int(with_power and any(map(bool, working)))
        run.memory = engine.pointer(self.memory)
        quaternions = np.append(packed.layout.quaternions, 0).astype(np.int32)
        run.quaternions = ffi.from_buffer("int[]", quaternions)
        run.n_quaternions = len(packed.layout.quaternions)
        self.keep_alive += [model, quaternions]
        if packed.event_functions.tape is not None:
            self._set_events(packed.event_functions.tape, packed.event_functions.ends, actions)
        if packed.user_scene.controller:
            controllers = Controllers(engine)
            run.n_controllers, run.controllers = controllers.count, controllers.records
            self.keep_alive.append(controllers)
        if system.has_loops and system.strain_index >= 0:
            speeds = np.zeros(2 * engine.nu + engine.nq)
            run.speeds = engine.pointer(speeds)
            self.keep_alive.append(speeds)
        self.workspace = np.zeros(packed.workspace)
        run.workspace = engine.pointer(self.workspace)
        self._code = compiled
        if compiled is not None:
            self._set_fused_code(compiled)
        self.system = ffi.new("mstmm_system *")
        engine.lib.mstmm_scene_system(run, self.system)

    def uses_code(self, compiled: SceneCode | None) -> bool:
        """True if the right-hand side is this fused code, or the looped engine for None."""
        code = self._code
        if code is None or compiled is None:
            return code is compiled
        same_library = code.scalar is compiled.scalar and code.lanes is compiled.lanes
        return same_library and code.numbers is compiled.numbers

    def offer_tangent(self) -> None:
        """Provide residual and tangent for implicit methods, by fused code where it exists."""
        engine, run = self.engine, self.run
        if self.system.implicit:
            return
        reject_qr_steps(engine.packed)
        base = TangentMatrix(engine, self.memory)
        stage, size = engine.ffi.new("mstmm_tangent *", base.record[0]), engine.nq + 2 * engine.nu
        work = np.zeros(engine.lib.mstmm_residual_work(engine.packed.model))
        base_state, coordinates = np.zeros(size), np.zeros(engine.nu + 1, dtype=np.int32)
        stage.workspace, stage.work = run.workspace, engine.pointer(work)
        run.base, run.stage, run.known = base.record, stage, engine.pointer(base_state)
        run.steady = int(engine.packed.system.is_autonomous)
        run.coordinates = engine.ffi.from_buffer("int[]", coordinates)
        engine.lib.mstmm_scene_implicit(run, self.system)
        self.keep_alive += [base, stage, work, base_state, coordinates]
        if self._code is not None and (implicit := self._code.implicit()) is not None:
            self._set_implicit_code(implicit, self._code.numbers)

    def enforce_positions(self) -> None:
        """Make implicit steps satisfy closed loops at position level instead of speed level.

        Call after `offer_tangent`.  Steps that are cut short keep to the speed level.
        """
        self.uses_position_level = True
        self.engine.lib.mstmm_scene_on_positions(self.run)

    def _set_implicit_code(self, code: FusedLibrary, start_numbers: Array) -> None:
        engine, lib = self.engine, self.engine.lib
        numbers = np.array(start_numbers)  # own copy: C writes the inputs into it during the run
        scratch = np.zeros(lib.mstmm_implicit_code_size(code.descriptor))
        pointers = engine.pointer(numbers), engine.pointer(scratch)
        lib.mstmm_implicit_by_code(self.run, code.descriptor, *pointers)
        self.keep_alive += [numbers, scratch, *pointers]

    def _set_fused_code(self, code: SceneCode) -> None:
        engine, lib = self.engine, self.engine.lib
        lanes = engine.ffi.NULL if code.lanes is None else code.lanes.descriptor
        numbers = np.array(code.numbers)  # own copy: C writes the inputs into it during the run
        live = LiveInputs(engine.packed.system, code.inputs)
        if live.varies:
            self.run.live.n, self.run.live.inputs = len(live.indices), engine.packed.model.inputs
            self.run.live.places = engine.ffi.from_buffer("int[]", live.indices)
            self.keep_alive.append(live)
        scratch = np.zeros(max(1, lib.mstmm_compiled_size(code.scalar.descriptor, lanes)))
        pointers = engine.pointer(numbers), engine.pointer(scratch)
        lib.mstmm_scene_compiled(self.run, code.scalar.descriptor, lanes, *pointers)
        self.keep_alive += [code, numbers, scratch, *pointers]

    def _set_events(
        self, tape: Tape, ends: Sequence[tuple[str, str]], actions: list[tuple[int, int]]
    ) -> None:
        """Write tape, probes and actions of events; `actions` are pairs (action, memory index)."""
        engine, ffi, run = self.engine, self.engine.ffi, self.run
        resize_workspace(engine.packed, tape.slots)
        run.event_tape = c_tape(ffi, tape, self.keep_alive)
        probes = [Probe(*engine.packed.end(b + (f".{e}" if e else ""))) for b, e in ends]
        records = engine.probes(probes)
        scratch = int(engine.lib.MSTMM_PROBE_NUMBERS) + engine.nq + engine.nu
        numbers = np.zeros(6 * len(probes) + scratch)
        run.probes, run.n_probes = records, len(probes)
        read = np.array([*_components_read(tape), 0], dtype=np.int32)
        bounds = ffi.new("mstmm_bounds[]", tape.slots)
        run.read, run.n_read = ffi.from_buffer("int[]", read), len(read) - 1
        run.bounds = bounds
        if _reads_velocities(tape):
            later_state = np.zeros(engine.nq + engine.nu + 1)
            run.later = engine.pointer(later_state)
            self.keep_alive.append(later_state)
        run.probe_values = engine.pointer(numbers)
        table = ffi.new("mstmm_event_action[]", max(1, len(actions)))
        for record, (action, release) in zip(table, actions, strict=False):
            record.action, record.release = action, release
        for bounce in engine.packed.event_functions.bounces:
            self._set_bounce(table[bounce.event], bounce)
        run.events, run.n_events = table, len(actions)
        run.closes = int(engine.packed.system.has_loops and _reads_state(engine.packed.scene))
        run.n_switches = min(len(self.switches), MAX_SWITCHES)
        self.keep_alive += [records, numbers, table, bounds, read]

    def _set_bounce(self, record: Any, bounce: Bounce) -> None:
        engine, ffi = self.engine, self.engine.ffi
        resize_workspace(engine.packed, bounce.slopes.slots)
        indices = np.array([bounce.places], dtype=np.int32).reshape(-1)
        numbers = np.zeros(1 + len(bounce.places) + 4 * engine.nu)
        record.slopes = c_tape(ffi, bounce.slopes, self.keep_alive)
        record.n_slopes, record.places = len(bounce.places), ffi.from_buffer("int[]", indices)
        record.restitution, record.numbers = bounce.restitution, engine.pointer(numbers)
        self.keep_alive += [indices, numbers]

    @property
    def has_power(self) -> bool:
        """True if the last state component is the work of non-conservative loads."""
        return bool(self.run.with_power)

    def begin(self, t: float, q: ArrayLike, u: ArrayLike) -> Array:
        """State vector at the start of a run, like `start`, after controllers have acted at t.

        Raises SceneError for a start on or past a contact, NumericalFailure where a controller
        cannot be evaluated.
        """
        y, packed = self.start(t, q, u), self.engine.packed
        if packed.system.strain_index >= 0:
            is_nearly_singular = self.run.strain > packed.model.loops_strain
            self.memory[packed.system.strain_index] = is_nearly_singular
        lib = self.engine.lib
        if lib.mstmm_controllers_act(self.run, t, self.engine.pointer(y)) > 0:
            raise NumericalFailure(self.engine.failure_text(self.run.failure, t))
        check_contact_start(self, t, y)
        return y

    def event_values(self, t: float, y: Array) -> Array | None:
        """Values of events (>= 0 where they hold), followed by the margins of switches.

        None where they cannot be evaluated.
        """
        calls, pointer = self.system, self.engine.pointer
        values = np.empty(calls.n_events + calls.n_switches)
        state = np.ascontiguousarray(y)
        if not len(values):
            return values
        failed = calls.events(calls.context, t, pointer(state), pointer(values))
        return None if failed else values

    def approach_rate(self, event: int, t: float, y: Array, u: Array) -> Any:
        """Rate of change of the value of a bounce event, as `mstmm_meeting`, at speeds u (nu,).

        Raises NumericalFailure where it cannot be evaluated.
        """
        engine, record = self.engine, self.engine.ffi.new("mstmm_meeting *")
        state, speeds = (engine.pointer(np.ascontiguousarray(x)) for x in (y, u))
        if engine.lib.mstmm_meeting_of(self.run, event, t, state, speeds, record):
            raise NumericalFailure(engine.failure_text(self.run.failure, t))
        return record

    def start(self, t: float, q: ArrayLike, u: ArrayLike) -> Array:
        """State vector at t, projected onto drives, unit quaternions and closed loops.

        Hinges released before t start free from the given q and u.  Raises SceneError where a loop
        does not close near the state.
        """
        y = np.concatenate(
            [np.asarray(q, float), np.asarray(u, float), np.zeros(int(self.has_power))]
        )
        y = np.ascontiguousarray(y)
        packed, run = self.engine.packed, self.run
        for name in hinges_released_by_time(packed.scene, t) if packed.releases else ():
            self.memory[packed.releases[name]] = 1.0
        run.failure.reason = 0  # may be set by an earlier state
        run.on_positions = 0  # a start satisfies the loops at speed level with every method
        self.engine.lib.mstmm_scene_settle(run, t, self.engine.pointer(y))
        run.on_positions = self.uses_position_level
        if run.failure.reason in (FailureCode.LOOP, FailureCode.COUPLING, FailureCode.FLAT):
            raise SceneError(f"scene: {self.engine.failure_text(self.run.failure, t)}")
        return y

    def components(self) -> StateNames:
        """Names of the state components."""
        return StateNames(self.engine.packed.layout, self.has_power)


def _components_read(tape: Tape) -> list[int]:
    """Indices of the components of q and u, in that order, that an event tape reads."""
    time, n_q, n_u, *_ = tape.input_lengths
    return sorted(slot - time for slot in _slots_read(tape) if time <= slot < time + n_q + n_u)


def _reads_velocities(tape: Tape) -> bool:
    """True if an event tape reads velocities of ends."""
    first = sum(tape.input_lengths[:3])
    points = range(first, first + tape.input_lengths[3])
    return any(slot in points and (slot - first) % 6 >= 3 for slot in _slots_read(tape))


def _slots_read(tape: Tape) -> set[int]:
    starts = range(0, len(tape.instructions), INSTRUCTION_WIDTH)
    rows = [tape.instructions[i : i + INSTRUCTION_WIDTH] for i in starts]
    return {slot for row in rows for slot in row[2:]} | set(tape.outputs[2::OUTPUT_WIDTH])


def _reads_state(scene: Scene) -> bool:
    """True if events or releases depend on more than time."""
    conditions = [event.when for event in scene.events]
    conditions += [hinge.release for hinge in scene.hinge if hinge.release is not None]
    return any(name.text != "t" for condition in conditions for name in condition.names)


def _event_actions(engine: LoopedEngine) -> tuple[list[tuple[int, int]], list[str]]:
    """Pairs (action, memory index), and names, of all events and releases."""
    packed, lib = engine.packed, engine.lib
    actions: list[tuple[int, int]] = []
    names: list[str] = []
    bounce_index = len(packed.releases)
    for number, event in enumerate(packed.scene.events):
        action = lib.MSTMM_FIRE_STOP if event.do == "stop" else lib.MSTMM_FIRE_RESTART
        memory_index = packed.releases[str(event.hinge)] if event.do == "release" else -1
        if event.do == "bounce":
            memory_index, bounce_index = bounce_index, bounce_index + 1
        actions.append((action, memory_index))
        names.append(packed.scene.event_label(number))
    for hinge in packed.scene.hinge:
        if hinge.release is not None:
            actions.append((lib.MSTMM_FIRE_RESTART, packed.releases[hinge.name]))
            names.append(f'release of hinge "{hinge.name}"')
    return actions, names


# --- starts on a contact --------------------------------------------------------------------------
#
# An event whose condition holds at the start fires there, so that a motion into the contact
# bounces.  A motion at rest on the contact does not bounce and would pass through it.

#: Relative tolerance within which a state counts as on the contact and as at rest there: of the
#: positions and speeds that the condition reads, at least of 1 rad or m and of 1 rad/s or m/s.
_TOLERANCE = 1e-9
#: Times in s over which the acceleration may release a resting contact: the longer one for slow
#: releases, the shorter one for fast rotations.
_RELEASE_TIMES = 1e-3, 1e-6


def check_contact_start(system: SceneSystem, t: float, y: Array) -> None:
    """Reject a start on or past a contact.

    Raises SceneError where the state rests on a bounce event or a hard stop, is past a bounce event
    without leaving it, or is past a hard stop.
    """
    bounces = system.engine.packed.event_functions.bounces
    values = system.event_values(t, y) if bounces else None
    if values is None:
        return
    for bounce in bounces:
        try:
            _check_bounce(system, bounce, float(values[bounce.event]), t, y)
        except NumericalFailure:  # the run meets the same failure and reports it
            continue


def _check_bounce(system: SceneSystem, bounce: Bounce, value: float, t: float, y: Array) -> None:
    contact = system.approach_rate(bounce.event, t, y, _speeds(system, y))
    tolerance = _TOLERANCE * contact.reach
    if not value >= -tolerance:
        return
    rate, is_past = _approach_rate(system, bounce, t, y), value > tolerance
    if rate == 0 or (is_past and (rate > 0 or _is_hard_stop(system, bounce))):
        raise SceneError(_message(system, bounce, y, value, is_past))


def _is_hard_stop(system: SceneSystem, bounce: Bounce) -> bool:
    return bounce.event >= len(system.engine.packed.scene.event)


def _speeds(system: SceneSystem, y: Array) -> Array:
    engine = system.engine
    return y[engine.nq : engine.nq + engine.nu]


def _approach_rate(system: SceneSystem, bounce: Bounce, t: float, y: Array) -> float:
    """Rate in 1/s at which a state moves into the contact.

    Negative where the state leaves the contact or its acceleration releases it, 0 where it rests.
    """
    contact = system.approach_rate(bounce.event, t, y, _speeds(system, y))
    tolerance = _TOLERANCE * (contact.size + contact.steepness)
    if abs(contact.rate) > tolerance:
        return float(contact.rate)
    rates = []
    for dt in _RELEASE_TIMES:
        later = _extrapolate(system, t, y, dt)
        contact = system.approach_rate(bounce.event, t + dt, later, _speeds(system, later))
        rates.append(float(contact.rate))
    return min(rates) if min(rates) < -tolerance else 0.0


def _extrapolate(system: SceneSystem, t: float, y: Array, dt: float) -> Array:
    """State after dt (s) with the accelerations at t."""
    engine = system.engine
    q, u, memory = (np.array(x)[None] for x in (y[: engine.nq], _speeds(system, y), system.memory))
    delta_u = dt * engine.accelerations(t, q, u, memory)[1]
    delta_q = dt * engine.accelerations(t, q, u + delta_u / 2, memory)[0]
    return np.concatenate([(q + delta_q)[0], (u + delta_u)[0]])


def _message(system: SceneSystem, bounce: Bounce, y: Array, value: float, is_past: bool) -> str:
    packed = system.engine.packed
    where, when = packed.scene.event_label(bounce.event), packed.scene.events[bounce.event].when
    if not _is_hard_stop(system, bounce):
        found = (
            f"past the contact by {value:.6g} and does not leave it"
            if is_past
            else "at rest on the contact"
        )
        return (
            f"{where}: the run starts {found} ({when.text!r} holds), so that it cannot bounce; "
            "start where the condition does not hold, or with a speed away from the contact"
        )
    assert when.comparison is not None
    coordinate, limit = bounce.places[0][0], when.comparison[2].constant or 0.0
    return (
        f"{where}: the run starts with {packed.layout.q_names[coordinate]} = "
        f"{y[coordinate]:.9g}, {'past' if is_past else 'at rest on'} the stop at {limit:.9g}, so "
        "that it cannot bounce; start between the stops, or with a speed away from the stop"
    )
