"""Error measures of models in which bodies and ends have other names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, cast

import numpy as np

from mstmm.array_validation import Array
from mstmm.numerics.rotations import Vector

from ..result.error_measure import Measure

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..result.quantity_names import Quantity
    from ..result.result_record import Record


def rename_reference(name: str, names: Mapping[str, str]) -> str:
    """New name of a body or end, or of its quantity such as "arm.tip.position"."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        reference = ".".join(parts[:count])
        if reference in names:
            return ".".join([names[reference], *parts[count:]])
    return name


def compose_names(first: Mapping[str, str], second: Mapping[str, str]) -> dict[str, str]:
    """Names after two successive renamings: former name -> last name."""
    return {**second, **{old: rename_reference(new, second) for old, new in first.items()}}


class Renaming(Measure):
    """Error measure that reads results of renamed models by the former names."""

    def __init__(self, inner: Measure) -> None:
        self.measure = inner
        self.name, self.unit, self.scaling = inner.name, inner.unit, inner.scaling
        self._renamings: dict[
            int, tuple[CompiledScene, Mapping[str, str], Mapping[str, Vector]]
        ] = {}

    def register(
        self,
        model: CompiledScene,
        names: Mapping[str, str],
        still: Mapping[str, Vector] | None = None,
    ) -> None:
        """Register the names of a model: former name -> new name, or -> fixed position (3,), m."""
        self._renamings[id(model)] = (model, names, still or {})

    def names_of(self, model: CompiledScene) -> Mapping[str, str]:
        """Names of a model: former name -> new name."""
        return self._renamings[id(model)][1] if id(model) in self._renamings else {}

    def read(self, result: Record) -> Array:
        """Measured values (n, k) of a run at its samples."""
        if id(result.model) not in self._renamings:
            return self.measure.read(result)
        _, names, still = self._renamings[id(result.model)]
        return self.measure.read(cast("Record", _RenamedRecord(result, names, still)))

    def distance(self, a: Array, b: Array) -> Array:
        """Distances (n,) between two sets of measured values."""
        return self.measure.distance(a, b)

    def set_scales(self, numbers: Array) -> None:
        """Scale relative errors by the measured values of the reference."""
        self.measure.set_scales(numbers)


class _RenamedRecord:
    """Positions and quantities of a result, by the former names."""

    def __init__(
        self, result: Record, names: Mapping[str, str], still: Mapping[str, Vector]
    ) -> None:
        self._result, self._names, self._fixed_points = result, names, still

    def position(self, name: str) -> Array:
        if name in self._fixed_points:
            return np.tile(self._fixed_points[name], (len(self._result.t), 1))
        return self._result.position(rename_reference(name, self._names))

    def quantity(self, name: str) -> Quantity:
        return self._result.quantity(rename_reference(name, self._names))
