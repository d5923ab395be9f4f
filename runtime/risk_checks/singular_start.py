"""Mechanisms that start in a singular configuration, where their motion is not unique."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import Risk

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings


def applies_to(model: CompiledScene) -> bool:
    """Whether loops start in a singular configuration with some initial speeds not given."""
    if model.loop_start is None or not model.loop_start.loops.singular:
        return False
    hinges = [hinge for hinge in model.packed_scene.user_scene.hinge if not hinge.is_weld]
    return any(
        hinge.drive is None and hinge.name not in model.loop_start.fast_hinges for hinge in hinges
    )


def singular_start_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """Risk that the given initial speeds do not determine the motion."""
    assert model.loop_start is not None
    if not np.array_equal(q, model.loop_start.start[0]):
        return
    hinge = model.loop_start.loops.redundant_rows[0][0]
    yield Risk(
        "branching-start", f'hinge "{hinge}"',
        "the loops start in a singular configuration, where the motion is not unique; if only some "
        "speeds are given, they may be compatible with no motion",
        "give the speeds of all hinges (initial.u) for the intended motion, or start in another "
        "configuration", seen_before_run=True,
    )  # fmt: skip
