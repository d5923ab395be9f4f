"""Controllers of a scene in C: matrices, what they measure, and where their state is kept."""

from __future__ import annotations

from typing import Any

import numpy as np

from mstmm.errors import SceneError
from mstmm.expression.expression import Expression, parse
from mstmm.scene.tables.scene_tables import SceneTables

from ..engine.looped_engine import LoopedEngine
from .measured_quantities import MeasuredQuantities, refuse_one_way


class Controllers:
    """`records` is `mstmm_controller[]` of a scene, `count` of them; it keeps all they point to.

    Raises SceneError, with the controller's name, for what a run cannot measure.
    """

    def __init__(self, engine: LoopedEngine) -> None:
        scene, ffi = engine.packed.described, engine.ffi
        self.count = len(scene.controller)
        refuse_one_way(engine.packed, f'controller "{scene.controller[0].name}"')
        self.records = ffi.new("mstmm_controller[]", self.count)
        self._kept: list[Any] = []
        place = engine.packed.system.held.first
        for record, one in zip(self.records, scene.controller, strict=True):
            try:
                shown = [expression_of(scene, name) for name in one.inputs]
                measured = MeasuredQuantities(
                    engine, shown, [output.name for output in scene.output]
                )
            except SceneError as error:
                raise SceneError(f'controller "{one.name}": inputs: {error}') from None
            record.sample_time, record.memory, record.measure = (
                one.sample_time, place, measured.record,
            )  # fmt: skip
            record.n_x, record.n_y, record.n_u = len(one.A), len(one.inputs), len(one.outputs)
            arrays = {key: np.array([*row, 0.0]) for key, row in one.filled.items()}
            for key in ("A", "B", "C", "D", "reference", "offset"):
                setattr(record, key, engine.pointer(arrays[key]))
            scratch = np.zeros(record.n_y + 1), np.zeros(record.n_x + 1)
            record.y, record.next = map(engine.pointer, scratch)
            self._kept += [measured, *arrays.values(), *scratch]
            place += 1 + record.n_x + record.n_u


def expression_of(scene: SceneTables, name: str) -> Expression:
    """What a name stands for: an output of the scene or a component of one, else a quantity."""
    for output in scene.output:
        if name == output.name:
            return output.of
        if name.startswith(f"{output.name}."):
            return parse(output.of.text + name.removeprefix(output.name))
    return parse(name)
