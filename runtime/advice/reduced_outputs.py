"""Outputs of a reduced scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from mstmm.scene import Scene

from ..chart.model_levels import with_tables

if TYPE_CHECKING:
    from ..model.model import Model


def with_available_outputs(scene: Scene, compile: Callable[[Scene], Model]) -> Scene:
    """The scene without the outputs that its results cannot provide."""
    if not scene.output:
        return scene
    available = compile(scene).simulate(0.0, "dop853").outputs()
    return with_tables(
        scene, output=tuple(output for output in scene.output if output.name in available)
    )
