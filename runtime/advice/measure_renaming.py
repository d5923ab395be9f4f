"""Measures of models in which places have other names."""

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
    """A place, or a quantity of one ("arm.tip.position"), by its new name."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        place = ".".join(parts[:count])
        if place in names:
            return ".".join([names[place], *parts[count:]])
    return name


def compose_names(first: Mapping[str, str], second: Mapping[str, str]) -> dict[str, str]:
    """Names after one change of them and then another."""
    return {**second, **{old: rename_reference(new, second) for old, new in first.items()}}


class Renaming(Measure):
    """A measure that reads models with other names as if they had the former ones."""

    def __init__(self, inner: Measure) -> None:
        self.inner = inner
        self.name, self.unit, self.scaling = inner.name, inner.unit, inner.scaling
        self._known: dict[int, tuple[CompiledScene, Mapping[str, str], Mapping[str, Vector]]] = {}

    def know(
        self,
        model: CompiledScene,
        names: Mapping[str, str],
        still: Mapping[str, Vector] | None = None,
    ) -> None:
        """Former name of a place -> its name in a model, and -> where it is if it stands still."""
        self._known[id(model)] = (model, names, still or {})

    def names_in(self, model: CompiledScene) -> Mapping[str, str]:
        """Former name -> its name in a model."""
        return self._known[id(model)][1] if id(model) in self._known else {}

    def read(self, result: Record) -> Array:
        """(n, k) numbers of a run at its samples."""
        if id(result.model) not in self._known:
            return self.inner.read(result)
        _, names, still = self._known[id(result.model)]
        return self.inner.read(cast("Record", _ByFormerNames(result, names, still)))

    def apart(self, a: Array, b: Array) -> Array:
        """(n,) distances of two of them."""
        return self.inner.apart(a, b)

    def scale_by(self, numbers: Array) -> None:
        """Take the sizes of what is compared from the reference."""
        self.inner.scale_by(numbers)


class _ByFormerNames:
    """What a measure asks of a result, by the former names."""

    def __init__(
        self, result: Record, names: Mapping[str, str], still: Mapping[str, Vector]
    ) -> None:
        self._result, self._names, self._still = result, names, still

    def position(self, name: str) -> Array:
        if name in self._still:
            return np.tile(self._still[name], (len(self._result.t), 1))
        return self._result.position(rename_reference(name, self._names))

    def quantity(self, name: str) -> Quantity:
        return self._result.quantity(rename_reference(name, self._names))
