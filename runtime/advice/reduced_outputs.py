"""Outputs of a scene in its reduced ones: only those there are."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from mstmm.scene import Scene

from ..chart.model_levels import with_tables

if TYPE_CHECKING:
    from ..model.model import Model


def with_outputs_there(scene: Scene, compile: Callable[[Scene], Model]) -> Scene:
    """The scene without the outputs that its results would lack."""
    if not scene.output:
        return scene
    there = compile(scene).simulate(0.0, "dop853").outputs()
    return with_tables(scene, output=tuple(one for one in scene.output if one.name in there))
