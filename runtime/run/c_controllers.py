"""C records of a scene's controllers: matrices, measured quantities, memory offset."""

from __future__ import annotations

from typing import Any

import numpy as np

from mstmm.errors import SceneError
from mstmm.expression.expression import Expression, parse
from mstmm.scene.tables.scene_tables import SceneTables

from ..engine.looped_engine import LoopedEngine
from .measured_quantities import MeasuredQuantities, reject_one_way


class Controllers:
    """`records`: `mstmm_controller[]` of a scene with `count` entries.

    The object owns all memory that the records point to.  Raises SceneError with the name of the
    controller for an input that a run cannot measure.
    """

    def __init__(self, engine: LoopedEngine) -> None:
        scene, ffi = engine.packed.user_scene, engine.ffi
        self.count = len(scene.controller)
        reject_one_way(engine.packed, f'controller "{scene.controller[0].name}"')
        self.records = ffi.new("mstmm_controller[]", self.count)
        self._keep_alive: list[Any] = []
        memory_offset = engine.packed.system.held_inputs.first
        output_names = [output.name for output in scene.output]
        for record, controller in zip(self.records, scene.controller, strict=True):
            try:
                expressions = [measured_expression(scene, name) for name in controller.inputs]
                measured = MeasuredQuantities(engine, expressions, output_names)
            except SceneError as error:
                raise SceneError(f'controller "{controller.name}": inputs: {error}') from None
            record.sample_time, record.memory = controller.sample_time, memory_offset
            record.measure = measured.record
            record.n_x, record.n_y = len(controller.A), len(controller.inputs)
            record.n_u = len(controller.outputs)
            arrays = {
                key: np.array([*row, 0.0]) for key, row in controller.complete_matrices.items()
            }
            for key in ("A", "B", "C", "D", "reference", "offset"):
                setattr(record, key, engine.pointer(arrays[key]))
            scratch = np.zeros(record.n_y + 1), np.zeros(record.n_x + 1)
            record.y, record.next = map(engine.pointer, scratch)
            self._keep_alive += [measured, *arrays.values(), *scratch]
            memory_offset += 1 + record.n_x + record.n_u


def measured_expression(scene: SceneTables, name: str) -> Expression:
    """Expression of an output of the scene, of a component of an output, or of a quantity."""
    for output in scene.output:
        if name == output.name:
            return output.of
        if name.startswith(f"{output.name}."):
            return parse(output.of.text + name.removeprefix(output.name))
    return parse(name)
