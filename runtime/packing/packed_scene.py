"""Scene as records of the looped engine."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from mstmm.numerics.piecewise_polynomial import NUMBERS_PER_PIECE, PiecewisePolynomial

from ..discontinuities.active_expressions import active_expressions
from ..discontinuities.time_map import TimeMap, time_map
from .records.model_record import Slopes, Written, write_slopes
from .scene_frames import Frames
from .switch_margins import EventFunctions, event_order
from .system import System

#: Largest number of cached time maps.
_MAX_TIME_MAPS = 8

#: Guards the compilation of derivative tapes, which several threads may request.
_SLOPES_LOCK = threading.Lock()


@dataclass
class PackedScene(Frames):
    """Scene in internal frames, in Python and as records of the engine.

    Attributes:
        scratch: index in the workspace behind the numbers of the bodies.
        tape_slots: largest workspace of a tape.
        workspace: length of the workspace.
        qr: whether accelerations come from the QR sweep.
        refined: whether accelerations of a tree are refined.
        held_input_names: names of the inputs that are set during a run.
        find_loop_cause: gives the cause and remedy of loops that cannot move on, "" if unknown.
    """

    system: System
    ffi: Any
    lib: Any
    model: Any
    written: Written
    scratch: int
    tape_slots: int = 0
    workspace: int = 0
    product: Any = None
    qr: bool = False
    refined: bool = False
    held_input_names: frozenset[str] = frozenset()
    find_loop_cause: Callable[[], str] = str
    _time_maps: dict[tuple[float, float], TimeMap] = field(default_factory=dict)
    _slopes: Slopes | None = None

    @property
    def channels(self) -> dict[str, PiecewisePolynomial]:
        """Input or signal name -> its values over time."""
        return dict(zip(self.layout.inputs, self.system.inputs, strict=True))

    @property
    def floors(self) -> list[float]:
        """Pivots (rows,) of the constraint rows below which they count as rounding."""
        return [] if self.written.loops is None else self.written.loops.floors

    def time_map(self, start: float, end: float) -> TimeMap:
        """Times at which steps from `start` to `end` (s) must end, and limits of their length."""
        span = (start, end)
        if span not in self._time_maps:
            if len(self._time_maps) >= _MAX_TIME_MAPS:
                self._time_maps.clear()
            inputs = self.channels
            samples = [controller.sample_time for controller in self.scene.controller]
            self._time_maps[span] = time_map(
                active_expressions(self.scene, self.held_input_names, inputs),
                start,
                end,
                inputs,
                samples,
            )
        return self._time_maps[span]

    def slopes(self) -> Slopes:
        """Derivative tapes of the scene's expressions; the first call adds them to the records."""
        with _SLOPES_LOCK:
            if self._slopes is None:
                self._slopes = write_slopes(self.system, self.model, self.ffi)
            return self._slopes

    @cached_property
    def event_functions(self) -> EventFunctions:
        """Tape of the event functions: events, releases and switches."""
        return event_order(self.scene, self.layout, self.held_input_names)

    @cached_property
    def is_time_dependent(self) -> bool:
        """Whether times of step ends or step limits may be known before a run."""
        return bool(self.scene.controller) or any(
            active.inputs or active.drive or "t" in {name.text for name in active.expression.names}
            for active in active_expressions(self.scene, self.held_input_names)
        )


def resize_workspace(packed: PackedScene, slots: int) -> None:
    """Resize the workspace for tapes of `slots` numbers behind the blocks of the bodies."""
    system, model = packed.system, packed.model
    packed.tape_slots = max(packed.tape_slots, slots)
    state = 2 * (system.nq + system.nu) + system.n_values + 3 * len(system.driven)
    state += NUMBERS_PER_PIECE * len(system.inputs)
    packed.workspace = packed.scratch + state + packed.tape_slots
    model.scratch, model.tape_slots = packed.scratch, packed.tape_slots
    model.workspace = packed.workspace


def enable_refinement(packed: PackedScene, times: int) -> None:
    """Refine the accelerations of a tree `times` times; call it before `resize_workspace`.

    Closed loops have their own workspace and number of refinements.
    """
    if packed.system.has_loops:
        return
    if not packed.refined:
        packed.model.answer = packed.scratch
        packed.scratch += packed.system.nu
    packed.refined, packed.model.refines = True, times
