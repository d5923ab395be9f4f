"""A scene as the arrays of the looped engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from mstmm.ir import KernelIR
from mstmm.scene import Scene, split
from mstmm.scene.checks.topology import GROUND_INDEX, Topology

from ..breaks.acting import acting
from ..breaks.times import TimeMap, time_map
from ..flexible.modal_body import ModalBody
from ..kernels.records import Records
from .flexible.expansion import Expanded
from .layout import Layout
from .placement import Placement
from .switches import Watched, watched

#: Spans of time whose maps are kept.
_MAPS = 8


@dataclass
class Packed:
    """A scene in the engine's arrays.  `kept` holds what C points to."""

    scene: Scene  #: of nodes: flexible bodies are replaced by theirs
    topology: Topology
    layout: Layout
    ffi: Any
    lib: Any
    model: Any
    records: Records
    placements: Mapping[str, Placement]
    positions: Mapping[str, int]
    hinge_position: Mapping[str, int]
    releases: dict[str, int]
    n_memory: int
    warnings: list[str] = field(default_factory=list)
    #: kernels of the scene's expressions: "values", "drives", and "effort k" of spring k
    expressions: dict[str, KernelIR] = field(default_factory=dict)
    kept: list[Any] = field(default_factory=list)
    expanded: Expanded | None = None
    _time_maps: dict[tuple[float, float], TimeMap] = field(default_factory=dict)

    def time_map(self, start: float, end: float) -> TimeMap:
        """Where the steps of a run from `start` to `end` (s) end, and how long they may be."""
        span = (start, end)
        if span not in self._time_maps:
            if len(self._time_maps) >= _MAPS:
                self._time_maps.clear()
            self._time_maps[span] = time_map(acting(self.scene), start, end)
        return self._time_maps[span]

    @cached_property
    def watched(self) -> Watched:
        """Events, releases and switches as one tape."""
        return watched(self.scene, self.layout)

    @property
    def described(self) -> Scene:
        """The scene as the user describes it."""
        return self.scene if self.expanded is None else self.expanded.described

    @property
    def flexible(self) -> Mapping[str, ModalBody]:
        """Numbers of the flexible bodies."""
        return {} if self.expanded is None else self.expanded.bodies

    def end(self, reference: str) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
        """(body position, axes (9), offset (3)) of "body" or "body.end", internal axes."""
        if self.expanded is not None:
            reference = self.expanded.nodes.get(reference, reference)
        name, at = split(reference)
        if name == "ground":
            return GROUND_INDEX, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0.0, 0.0, 0.0)
        place = self.placements[name]
        body = self.scene.bodies.by_name[name]
        axes = place.axes(body.end_rotation(at))
        return (
            self.positions[name],
            (*axes[0], *axes[1], *axes[2]),
            place.point(body.end_position(at)),
        )


def resize(packed: Packed, slots: int) -> None:
    """Room for tapes of `slots` numbers behind the blocks."""
    model = packed.model
    model.tape_slots = max(int(model.tape_slots), slots)
    tail = 2 * (model.nq + model.nu) + model.n_values + 3 * model.n_drives + model.tape_slots
    model.workspace = model.scratch + tail
