"""What the errors of a chart are errors of: measures of any result, or the places of bodies, which
every level of model has.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array

from ..model.sizes import scene_length
from ..result.measure import Coordinates, Measure, Quantities

if TYPE_CHECKING:
    from ..engine.compiled import Compiled
    from ..result.record import Record
    from ..result.result import Result


class Places(Measure):
    """The places of all bodies and ends, which every level of model has."""

    name = "places of all bodies and ends"

    def __init__(self, model: Compiled, start: Result) -> None:
        ports = [port for body in model.flexible.values() for port in body.ports.values()]
        lengths = [float(np.linalg.norm(port.position)) for port in ports]
        self._length = max(scene_length(model), *lengths, 0.0)
        ending = ".position"
        self._names = [name[: -len(ending)] for name in start.names() if name.endswith(ending)]
        self.scaling = f"parts of the length of the scene, {self._length:g} m"

    def read(self, result: Record) -> Array:
        return np.hstack([result.position(name) for name in self._names])

    def apart(self, a: Array, b: Array) -> Array:
        ways = (a - b).reshape(len(a), -1, 3)
        return np.asarray(np.linalg.norm(ways, axis=2).max(axis=1) / self._length)


def measure_of(model: Compiled, start: Result, names: Sequence[str], models: bool) -> Measure:
    """What is compared; `start` is a result of the model with one sample.

    Raises SceneError, with the nearest name, for a quantity that the model does not have.
    """
    if names:
        return Quantities(start, names)
    return Places(model, start) if models else Coordinates(model)
