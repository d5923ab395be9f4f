"""What the errors of a chart are errors of: measures of any result, or the places of bodies, which
every level of model has.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ..engine.characteristic_scales import scene_length
from ..result.error_measure import Coordinates, Measure, Quantities

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..result.result import Result
    from ..result.result_record import Record


class Places(Measure):
    """The places of all bodies and ends, which every level of model has.

    Of a flexible body its ends alone: its floating frame lies elsewhere on every level.
    """

    name = "places of all bodies and ends"

    def __init__(self, model: CompiledScene, start: Result) -> None:
        self._length, scene = whole_length(model), model.scene
        ending, floating = ".position", {one.name for one in (*scene.beam, *scene.elastic)}
        names = [name[: -len(ending)] for name in start.names() if name.endswith(ending)]
        self._names = [name for name in names if name not in floating]
        self.scaling = f"parts of the length of the scene, {self._length:g} m"

    def read(self, result: Record) -> Array:
        return np.hstack([result.position(name) for name in self._names])

    def apart(self, a: Array, b: Array) -> Array:
        ways = (a - b).reshape(len(a), -1, 3)
        return np.asarray(np.linalg.norm(ways, axis=2).max(axis=1) / self._length)


def whole_length(model: CompiledScene) -> float:
    """The length of a scene, m, by its rigid and its flexible bodies."""
    ports = [port for body in model.flexible.values() for port in body.ports.values()]
    return max([scene_length(model), *(float(np.linalg.norm(port.position)) for port in ports)])


def measure_of(model: CompiledScene, start: Result, names: Sequence[str], models: bool) -> Measure:
    """What is compared; `start` is a result of the model with one sample.

    Raises SceneError, with the nearest name, for a quantity that the model does not have.
    """
    if names:
        return Quantities(start, names)
    return Places(model, start) if models else Coordinates(model)
