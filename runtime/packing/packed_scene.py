"""A scene as the arrays of the looped engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from mstmm.numerics.piecewise_polynomial import NUMBERS_PER_PIECE, PiecewisePolynomial

from ..discontinuities.active_expressions import active_expressions
from ..discontinuities.time_map import TimeMap, time_map
from .records.expression_derivatives import LOCK, Slopes, write_slopes
from .records.model_record import Written
from .scene_frames import Frames
from .switch_margins import Watched, event_order
from .system import System

#: Spans of time whose maps are kept.
_MAPS = 8


@dataclass
class PackedScene(Frames):
    """A scene in internal frames, in Python and in the engine's arrays.

    `scratch` is the first number of the workspace behind what the bodies need, `tape_slots` the
    largest workspace of a tape, `workspace` the whole length; `qr` is whether the sweep is that of
    least squares, `refined` whether accelerations of a tree are refined.
    `held` are the inputs that are set during a run, by name.  `behind` says, where it is known,
    what is behind closed loops that cannot go on, and what to do.
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
    held: frozenset[str] = frozenset()
    behind: Callable[[], str] = str
    _time_maps: dict[tuple[float, float], TimeMap] = field(default_factory=dict)
    _slopes: Slopes | None = None

    @property
    def channels(self) -> dict[str, PiecewisePolynomial]:
        """Inputs and signals over time by their names, as this system has them."""
        return dict(zip(self.layout.inputs, self.system.inputs, strict=True))

    @property
    def floors(self) -> list[float]:
        """Up to where pivots of the rows of closed loops are rounding."""
        return [] if self.written.loops is None else self.written.loops.floors

    def time_map(self, start: float, end: float) -> TimeMap:
        """Where the steps of a run from `start` to `end` (s) end, and how long they may be."""
        span = (start, end)
        if span not in self._time_maps:
            if len(self._time_maps) >= _MAPS:
                self._time_maps.clear()
            inputs, samples = self.channels, [one.sample_time for one in self.scene.controller]
            found = time_map(
                active_expressions(self.scene, self.held, inputs), start, end, inputs, samples
            )
            self._time_maps[span] = found
        return self._time_maps[span]

    def slopes(self) -> Slopes:
        """Derivatives of the scene's expressions, in the records from now on."""
        with LOCK:
            if self._slopes is None:
                self._slopes = write_slopes(self.system, self.model, self.ffi)
            return self._slopes

    @cached_property
    def watched(self) -> Watched:
        """Events, releases and switches as one tape."""
        return event_order(self.scene, self.layout, self.held)

    @cached_property
    def goes_by_time(self) -> bool:
        """Whether steps of a run may have to end, or to be short, somewhere known before."""
        return bool(self.scene.controller) or any(
            one.inputs or one.drive or "t" in {name.text for name in one.expression.names}
            for one in active_expressions(self.scene, self.held)
        )


def resize_workspace(packed: PackedScene, slots: int) -> None:
    """Room for tapes of `slots` numbers behind the blocks."""
    system, model = packed.system, packed.model
    packed.tape_slots = max(packed.tape_slots, slots)
    state = 2 * (system.nq + system.nu) + system.n_values + 3 * len(system.driven)
    state += NUMBERS_PER_PIECE * len(system.inputs)
    packed.workspace = packed.scratch + state + packed.tape_slots
    model.scratch, model.tape_slots = packed.scratch, packed.tape_slots
    model.workspace = packed.workspace


def enable_refinement(packed: PackedScene, times: int) -> None:
    """Let the packed tree refine its accelerations so often, by an answer behind the blocks, before
    it is resized; closed loops have room for theirs, and say themselves how often."""
    if packed.system.closes:
        return
    if not packed.refined:
        packed.model.answer = packed.scratch
        packed.scratch += packed.system.nu
    packed.refined, packed.model.refines = True, times
