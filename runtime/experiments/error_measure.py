"""Error measures: distance of two runs over all coordinates, or over named quantities.

A measure reads values (n, k) from a result and computes the distances (n,) of two of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ..engine.compiled_scene import scene_length
from ..run.error_estimate import differences, excursions, rotation_between

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..result.quantity_names import Quantity
    from ..result.result import Result
    from ..result.result_record import Record


class Measure(ABC):
    """Error measure for the comparison of two runs.

    Attributes:
        name, unit, scaling: for readers; the unit is "1" for scaled values.
    """

    name = ""
    unit = "1"
    scaling = "none"

    @abstractmethod
    def read(self, result: Record) -> Array:
        """Read the compared values (n, k) of a run at its samples."""

    @abstractmethod
    def distance(self, a: Array, b: Array) -> Array:
        """Distances (n,) of two runs from their values (n, k)."""

    def set_scales(self, numbers: Array) -> None:  # noqa: B027 - most measures need no reference
        """Set the scales from the reference, where they depend on the run."""


class Coordinates(Measure):
    """Error measure over all coordinates of the scene."""

    name = "all coordinates"
    scaling = (
        "angles in rad; lengths, modal coordinates and others in parts of the largest excursion of "
        "any coordinate of that unit in the reference"
    )

    def __init__(self, model: CompiledScene) -> None:
        self._layout = model.coordinate_layout
        self._sizes: dict[str, float] = {}

    def read(self, result: Record) -> Array:
        return result.q

    @property
    def min_scale(self) -> float:
        """Smallest scale of units other than rad, at most 1."""
        return min([1.0, *self._sizes.values()])

    def set_scales(self, numbers: Array) -> None:
        excursion_by_unit = excursions(self._layout, numbers, but="rad")
        self._sizes = {unit: size or 1.0 for unit, size in excursion_by_unit.items()}

    def distance(self, a: Array, b: Array) -> Array:
        distances = np.zeros(len(a))
        for unit, difference in differences(self._layout, a, b, "q"):
            distances = np.maximum(distances, difference / self._sizes.get(unit, 1.0))
        return distances


class Quantities(Measure):
    """Error measure over named quantities: one in its unit, several over their excursions."""

    def __init__(self, start: Record, names: Sequence[str]) -> None:
        self._names = tuple(dict.fromkeys(names))
        quantities = [_quantity(start, name) for name in self._names]
        self._widths = [
            1 if quantity.values.ndim == 1 else quantity.values.shape[1] for quantity in quantities
        ]
        self._is_quaternion = [quantity.labels == tuple("wxyz") for quantity in quantities]
        self._sizes = [1.0] * len(quantities)
        self.name = ", ".join(self._names)
        if len(quantities) == 1:
            self.unit = "rad" if self._is_quaternion[0] else quantities[0].unit or "1"
            self.scaling = "none: the length of the difference" if self._widths[0] > 1 else "none"
        else:
            self.scaling = "each in parts of its largest excursion in the reference"

    def read(self, result: Record) -> Array:
        columns = [_quantity(result, name).values for name in self._names]
        return np.hstack([values.reshape(len(values), -1) for values in columns])

    def set_scales(self, numbers: Array) -> None:
        if len(self._names) > 1:
            start = np.broadcast_to(numbers[:1], numbers.shape)
            self._sizes = [
                float(distance.max()) or 1.0 for distance in self._distances(numbers, start)
            ]

    def distance(self, a: Array, b: Array) -> Array:
        distances = self._distances(a, b)
        return np.max(
            [distance / scale for distance, scale in zip(distances, self._sizes, strict=True)],
            axis=0,
        )

    def _distances(self, a: Array, b: Array) -> list[Array]:
        """Distances (n,), one array for each quantity."""
        split_indices = np.cumsum(self._widths)[:-1]
        pairs = zip(
            np.split(a, split_indices, axis=1), np.split(b, split_indices, axis=1), strict=True
        )
        return [
            rotation_between(x, y) if is_rotation else np.linalg.norm(x - y, axis=1)
            for (x, y), is_rotation in zip(pairs, self._is_quaternion, strict=True)
        ]


def _quantity(result: Record, name: str) -> Quantity:
    try:
        return result.quantity(name)
    except SceneError as error:
        raise SceneError(f"quantity {error}") from None


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
