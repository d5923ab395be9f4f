"""Closed loops with constraint rows that are redundant except for a small position gap."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ..result.loop_closure_error import MISFIT_REMEDY, MISFIT_RISK

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings


def applies_to(model: CompiledScene) -> bool:
    """Whether omitted redundant rows have a gap above rounding."""
    return model.loop_start is not None and model.loop_start.loops.redundancy_gap[0] > 0.0


def redundancy_gap_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """Risk of the omitted row with the largest gap."""
    assert model.loop_start is not None
    gap, name, direction = model.loop_start.loops.redundancy_gap
    yield Risk(
        MISFIT_RISK, f'"{name}"',
        f"direction {direction} of the loop is redundant, violated by {gap:.1e} (m, rad); it is "
        "left out, for the mechanism would lock if it were satisfied exactly",
        MISFIT_REMEDY, gap, seen_before_run=True,
    )  # fmt: skip
