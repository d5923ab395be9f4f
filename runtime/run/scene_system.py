"""A packed scene as the system that the time integration advances."""

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

from ..engine.engine_calls import Probe
from ..engine.live_inputs import LiveInputs, Places
from ..engine.looped_engine import LoopedEngine
from ..engine.tangent_matrix import TangentMatrix
from ..kernels.fused_library import FusedLibrary
from ..kernels.tape_kernel import c_tape
from ..packing.coordinate_layout import StateNames
from ..packing.hinge_release import hinges_released_by_time
from ..packing.packed_scene import resize_workspace
from ..packing.qr_sweep import reject_qr_steps
from ..packing.records.bounce_records import Bounce
from ..packing.switch_margins import MOST
from .c_controllers import Controllers
from .contact_start import check_contact_start


@dataclass(frozen=True)
class SceneCode:
    """Code compiled for a scene: for one state, for several side by side, their numbers, where
    inputs stand in them, and what gives the code for what implicit methods ask, if there is any."""

    one: FusedLibrary
    lanes: FusedLibrary | None
    numbers: Array
    inputs: Places
    implicit: Callable[[], FusedLibrary | None]


class SceneSystem:
    """`mstmm_system` of a model: events, power and memory of its own.

    With `compiled` the right-hand side is that code; events and settling stay with the engine.
    Without `with_power` the work of what is not stored is not integrated.
    """

    def __init__(
        self, engine: LoopedEngine, compiled: SceneCode | None = None, with_power: bool = True
    ) -> None:
        packed, ffi = engine.packed, engine.ffi
        self.engine, self.kept = engine, list[Any]()
        actions, self.event_names = _actions(engine)
        self.switches, self.on_positions = packed.watched.switches, False
        self.memory = engine.start_memory()
        model, system = packed.model, packed.system
        self.run = run = ffi.new("mstmm_scene_run *")
        run.model = model
        works = bool(system.laws or system.driven or system.loads or system.forces)
        works = works or bool(system.couplings) or bool(packed.watched.bounces)
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
        if packed.described.controller:
            controllers = Controllers(engine)
            run.n_controllers, run.controllers = controllers.count, controllers.records
            self.kept.append(controllers)
        if system.closes and system.strained >= 0:
            speeds = np.zeros(2 * engine.nu + engine.nq)
            run.speeds = engine.pointer(speeds)
            self.kept.append(speeds)
        self.workspace = np.zeros(packed.workspace)
        run.workspace = engine.pointer(self.workspace)
        self._code = compiled
        if compiled is not None:
            self._compiled(compiled)
        self.system = ffi.new("mstmm_system *")
        engine.lib.mstmm_scene_system(run, self.system)

    def goes_by(self, compiled: SceneCode | None) -> bool:
        """Whether the right-hand side is this code, or none where none is given."""
        code = self._code
        if code is None or compiled is None:
            return code is compiled
        same = code.one is compiled.one and code.lanes is compiled.lanes
        return same and code.numbers is compiled.numbers

    def offer_tangent(self) -> None:
        """Make what implicit methods ask for: residual and tangent, by code compiled for them where
        it is given."""
        engine, run = self.engine, self.run
        if self.system.implicit:
            return
        reject_qr_steps(engine.packed)
        base = TangentMatrix(engine, self.memory)
        stage, size = engine.ffi.new("mstmm_tangent *", base.record[0]), engine.nq + 2 * engine.nu
        work = np.zeros(engine.lib.mstmm_residual_work(engine.packed.model))
        known, coordinates = np.zeros(size), np.zeros(engine.nu + 1, dtype=np.int32)
        stage.workspace, stage.work = run.workspace, engine.pointer(work)
        run.base, run.stage, run.known = base.record, stage, engine.pointer(known)
        run.steady = int(engine.packed.system.steady)
        run.coordinates = engine.ffi.from_buffer("int[]", coordinates)
        engine.lib.mstmm_scene_implicit(run, self.system)
        self.kept += [base, stage, work, known, coordinates]
        if self._code is not None and (implicit := self._code.implicit()) is not None:
            self._implicit_by(implicit, self._code.numbers)

    def ask_positions(self) -> None:
        """From now on steps of implicit methods, which have been offered a tangent, ask rows of
        closed loops for positions where they end, and nothing of speeds; but for steps that are cut
        short."""
        self.on_positions = True
        self.engine.lib.mstmm_scene_on_positions(self.run)

    def _implicit_by(self, code: FusedLibrary, given: Array) -> None:
        engine, lib = self.engine, self.engine.lib
        numbers = np.array(given)  # where inputs are written as time goes on
        scratch = np.zeros(lib.mstmm_implicit_code_size(code.descriptor))
        pointers = engine.pointer(numbers), engine.pointer(scratch)
        lib.mstmm_implicit_by_code(self.run, code.descriptor, *pointers)
        self.kept += [numbers, scratch, *pointers]

    def _compiled(self, code: SceneCode) -> None:
        engine, lib = self.engine, self.engine.lib
        lanes = engine.ffi.NULL if code.lanes is None else code.lanes.descriptor
        numbers = np.array(code.numbers)  # where inputs are written as time goes on
        live = LiveInputs(engine.packed.system, code.inputs)
        if live.varies:
            self.run.live.n, self.run.live.inputs = len(live.places), engine.packed.model.inputs
            self.run.live.places = engine.ffi.from_buffer("int[]", live.places)
            self.kept.append(live)
        scratch = np.zeros(max(1, lib.mstmm_compiled_size(code.one.descriptor, lanes)))
        pointers = engine.pointer(numbers), engine.pointer(scratch)
        lib.mstmm_scene_compiled(self.run, code.one.descriptor, lanes, *pointers)
        self.kept += [code, numbers, scratch, *pointers]

    def _events(
        self, tape: Tape, ends: Sequence[tuple[str, str]], actions: list[tuple[int, int]]
    ) -> None:
        engine, ffi, run = self.engine, self.engine.ffi, self.run
        resize_workspace(engine.packed, tape.slots)
        run.event_tape = c_tape(ffi, tape, self.kept)
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
            later = np.zeros(engine.nq + engine.nu + 1)
            run.later = engine.pointer(later)
            self.kept.append(later)
        run.probe_values = engine.pointer(numbers)
        table = ffi.new("mstmm_event_action[]", max(1, len(actions)))
        for record, (action, release) in zip(table, actions, strict=False):
            record.action, record.release = action, release
        for bounce in engine.packed.watched.bounces:
            self._bounce(table[bounce.event], bounce)
        run.events, run.n_events = table, len(actions)
        run.closes = int(engine.packed.system.closes and _read_states(engine.packed.scene))
        run.n_switches = min(len(self.switches), MOST)
        self.kept += [records, numbers, table, bounds, read]

    def _bounce(self, record: Any, bounce: Bounce) -> None:
        engine, ffi = self.engine, self.engine.ffi
        resize_workspace(engine.packed, bounce.slopes.slots)
        places = np.array([bounce.places], dtype=np.int32).reshape(-1)
        numbers = np.zeros(1 + len(bounce.places) + 4 * engine.nu)
        record.slopes = c_tape(ffi, bounce.slopes, self.kept)
        record.n_slopes, record.places = len(bounce.places), ffi.from_buffer("int[]", places)
        record.restitution, record.numbers = bounce.restitution, engine.pointer(numbers)
        self.kept += [places, numbers]

    @property
    def with_power(self) -> bool:
        """True if the state ends with the work of everything that is not stored."""
        return bool(self.run.with_power)

    def begin(self, t: float, q: ArrayLike, u: ArrayLike) -> Array:
        """`start` of a run between hard stops: controllers that act at t have done so."""
        y, packed = self.start(t, q, u), self.engine.packed
        if packed.system.strained >= 0:
            near = self.run.strain > packed.model.loops_strain
            self.memory[packed.system.strained] = near
        lib = self.engine.lib
        if lib.mstmm_controllers_act(self.run, t, self.engine.pointer(y)) > 0:
            raise NumericalFailure(self.engine.failure_text(self.run.failure, t))
        check_contact_start(self, t, y)
        return y

    def watched(self, t: float, y: Array) -> Array | None:
        """Values of the events, >= 0 where they hold, and behind them the margins of switches;
        None where they cannot be evaluated."""
        calls, pointer = self.system, self.engine.pointer
        values = np.empty(calls.n_events + calls.n_switches)
        state = np.ascontiguousarray(y)
        if not len(values):
            return values
        failed = calls.events(calls.context, t, pointer(state), pointer(values))
        return None if failed else values

    def meeting(self, event: int, t: float, y: Array, u: Array) -> Any:
        """`mstmm_meeting`: how the value of an event that bounces changes at a state with speeds u
        (nu,).  Raises NumericalFailure where that cannot be evaluated."""
        engine, found = self.engine, self.engine.ffi.new("mstmm_meeting *")
        state, speeds = (engine.pointer(np.ascontiguousarray(x)) for x in (y, u))
        if engine.lib.mstmm_meeting_of(self.run, event, t, state, speeds, found):
            raise NumericalFailure(engine.failure_text(self.run.failure, t))
        return found

    def start(self, t: float, q: ArrayLike, u: ArrayLike) -> Array:
        """State vector at t with driven coordinates, quaternions, loops and memory in order.

        Hinges that have let go by then go on from what is given, as free ones.  Raises SceneError
        where a loop does not close near the state.
        """
        y = np.concatenate(
            [np.asarray(q, float), np.asarray(u, float), np.zeros(int(self.with_power))]
        )
        y = np.ascontiguousarray(y)
        packed, run = self.engine.packed, self.run
        for name in hinges_released_by_time(packed.scene, t) if packed.releases else ():
            self.memory[packed.releases[name]] = 1.0
        run.failure.reason = 0  # of another state that did not close
        run.on_positions = 0  # no start slips, whatever the steps of this system's last run left
        self.engine.lib.mstmm_scene_settle(run, t, self.engine.pointer(y))
        run.on_positions = self.on_positions
        if run.failure.reason in (FailureCode.LOOP, FailureCode.COUPLING, FailureCode.FLAT):
            raise SceneError(f"scene: {self.engine.failure_text(self.run.failure, t)}")
        return y

    def components(self) -> StateNames:
        """A name per component of the state."""
        return StateNames(self.engine.packed.layout, self.with_power)


def _components_read(tape: Tape) -> list[int]:
    """Which components of q and u, in that order, an event tape reads."""
    time, n_q, n_u, *_ = tape.input_lengths
    return sorted(slot - time for slot in _slots_read(tape) if time <= slot < time + n_q + n_u)


def _reads_velocities(tape: Tape) -> bool:
    """Whether an event tape reads velocities of ends."""
    first = sum(tape.input_lengths[:3])
    points = range(first, first + tape.input_lengths[3])
    return any(slot in points and (slot - first) % 6 >= 3 for slot in _slots_read(tape))


def _slots_read(tape: Tape) -> set[int]:
    width = INSTRUCTION_WIDTH
    rows = [tape.instructions[i : i + width] for i in range(0, len(tape.instructions), width)]
    return {slot for row in rows for slot in row[2:]} | set(tape.outputs[2::OUTPUT_WIDTH])


def _read_states(scene: Scene) -> bool:
    """Whether events or releases go by more than time."""
    conditions = [one.when for one in scene.events]
    conditions += [one.release for one in scene.hinge if one.release is not None]
    return any(name.text != "t" for one in conditions for name in one.names)


def _actions(engine: LoopedEngine) -> tuple[list[tuple[int, int]], list[str]]:
    """(action, memory place) and name of every event and release."""
    packed, lib = engine.packed, engine.lib
    actions: list[tuple[int, int]] = []
    names: list[str] = []
    bounces = len(packed.releases)
    for number, event in enumerate(packed.scene.events):
        action = lib.MSTMM_FIRE_STOP if event.do == "stop" else lib.MSTMM_FIRE_RESTART
        place = packed.releases[str(event.hinge)] if event.do == "release" else -1
        if event.do == "bounce":
            place, bounces = bounces, bounces + 1
        actions.append((action, place))
        names.append(packed.scene.happening(number))
    for hinge in packed.scene.hinge:
        if hinge.release is not None:
            actions.append((lib.MSTMM_FIRE_RESTART, packed.releases[hinge.name]))
            names.append(f'release of hinge "{hinge.name}"')
    return actions, names
