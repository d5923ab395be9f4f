"""Error measures of a chart: quantities, coordinates, or positions of all bodies and ends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ..engine.compiled_scene import scene_length
from ..result.error_measure import Coordinates, Measure, Quantities

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..result.result import Result
    from ..result.result_record import Record


class PositionMeasure(Measure):
    """Positions of all bodies and ends, relative to the scene length; for any level.

    Flexible bodies are compared at their ends only: the position of the floating frame depends on
    the model level.
    """

    name = "positions of all bodies and ends"

    def __init__(self, model: CompiledScene, start: Result) -> None:
        self._length, scene = scene_length_with_ends(model), model.scene
        suffix, floating = ".position", {body.name for body in (*scene.beam, *scene.elastic)}
        names = [
            name.removesuffix(suffix) for name in start.quantity_names() if name.endswith(suffix)
        ]
        self._names = [name for name in names if name not in floating]
        self.scaling = f"relative to the length of the scene, {self._length:g} m"

    def read(self, result: Record) -> Array:
        return np.hstack([result.position(name) for name in self._names])

    def distance(self, a: Array, b: Array) -> Array:
        displacements = (a - b).reshape(len(a), -1, 3)
        return np.asarray(np.linalg.norm(displacements, axis=2).max(axis=1) / self._length)


def scene_length_with_ends(model: CompiledScene) -> float:
    """Length of a scene, m, including the ends of its flexible bodies."""
    ports = [port for body in model.flexible_bodies.values() for port in body.ports.values()]
    return max([scene_length(model), *(float(np.linalg.norm(port.position)) for port in ports)])


def select_measure(
    model: CompiledScene, start: Result, names: Sequence[str], models: bool
) -> Measure:
    """Error measure of these quantities; without names, of all coordinates or positions.

    `start` is a result of the model with one sample; `models` selects positions, which every model
    level has.  Raises SceneError, with the nearest name, for a quantity that the model lacks.
    """
    if names:
        return Quantities(start, names)
    return PositionMeasure(model, start) if models else Coordinates(model)
