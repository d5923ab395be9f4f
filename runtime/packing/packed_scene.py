"""Scene with the positions of its parts, and its records of the looped engine."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

from mstmm.graph.mechanism_graph import GROUND
from mstmm.numerics.piecewise_polynomial import NUMBERS_PER_PIECE, PiecewisePolynomial
from mstmm.scene import Scene, split_reference
from mstmm.scene.checks.topology import Topology
from mstmm.scene.tables.chain import Members

from ..discontinuities.active_expressions import active_expressions
from ..discontinuities.time_map import TimeMap, time_map
from ..flexible.modal_body import ModalBody
from ..kernels.prebuilt_kernels import Elements
from .coordinate_layout import Layout
from .event_functions import EventFunctions, event_order
from .expansion import ExpandedScene
from .internal_frames import Placement
from .records.model_record import Slopes, Written, write_slopes
from .simplification import Simplification, SimplifyOptions
from .system import System

# --- hinges that are released during a run --------------------------------------------------------


def releasable_hinges(scene: Scene) -> list[str]:
    """Names of hinges that may be released, by their own `release` or by an event."""
    names = [h.name for h in scene.hinge if h.release is not None]
    for event in scene.event:
        if event.do == "release" and event.hinge not in names:
            names.append(str(event.hinge))
    return names


def hinges_released_by_time(scene: Scene, t: float) -> list[str]:
    """Names of hinges that are released at t (s) by conditions that depend on time only."""
    releases = [(h.name, h.release) for h in scene.hinge if h.release is not None]
    events = [(str(e.hinge), e.when) for e in scene.event if e.do == "release"]
    return [
        name for name, condition in releases + events
        if condition.depends_on_time_only and condition.evaluate(lambda _: t) > 0
    ]  # fmt: skip


T = TypeVar("T")


# --- positions in the tree, in q and u, and in internal frames ------------------------------------


class Lookup(Mapping[str, T]):
    """Mapping from names of bodies or hinges to values computed from their index on access."""

    def __init__(self, members: Members[Any], get: Callable[[int], T]) -> None:
        self.members, self.get_number = members, get

    def __getitem__(self, name: str) -> T:
        number = self.members.find(name)
        if number is None:
            raise KeyError(name)
        return self.get_number(number)

    def __iter__(self) -> Iterator[str]:
        return self.members.names()

    def __len__(self) -> int:
        return len(self.members)


@dataclass
class Frames:
    """Scene of nodes with its tree, layout, internal frames and elements.

    Attributes:
        scene: of nodes, which replace the flexible bodies.
        releases: hinge that may be released -> index in memory.
        placements: body -> internal frame.
        positions: body -> position in the tree.
        hinge_position: hinge -> position of its outboard body in the tree.
        simplified: simplifications done.
        simplify: simplifications requested.
    """

    scene: Scene
    topology: Topology
    layout: Layout
    elements: Elements
    releases: Mapping[str, int]
    placements: Mapping[str, Placement]
    positions: Mapping[str, int]
    hinge_position: Mapping[str, int]
    expanded: ExpandedScene
    simplified: tuple[Simplification, ...]
    simplify: SimplifyOptions

    @property
    def user_scene(self) -> Scene:
        """Scene as the user wrote it."""
        return self.expanded.user_scene

    @property
    def flexible(self) -> Mapping[str, ModalBody]:
        """Flexible bodies of the run by name."""
        return self.expanded.bodies

    @property
    def modal(self) -> Mapping[str, ModalBody]:
        """Flexible bodies of the run, and one-way coupled ones, by name."""
        rigidified = self.expanded.rigidified
        return {**self.flexible, **(rigidified.one_way if rigidified else {})}

    def mass_center(self, name: str) -> tuple[float, ...]:
        """Mass centre (3,) of a body in internal axes, m."""
        return self.placements[name].point(self.scene.bodies.by_name[name].center_of_mass)

    def end(self, reference: str) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
        """End "body.end" or origin "body": (position in the tree, axes (9), offset (3) in m)."""
        name, end = split_reference(self.expanded.nodes.get(reference, reference))
        if name == "ground":
            return GROUND, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0.0, 0.0, 0.0)
        placement = self.placements[name]
        body = self.scene.bodies.by_name[name]
        axes = placement.axes(body.end_rotation(end))
        return (
            self.positions[name],
            (*axes[0], *axes[1], *axes[2]),
            placement.point(body.end_position(end)),
        )


# --- records --------------------------------------------------------------------------------------

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
