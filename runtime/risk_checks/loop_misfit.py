"""Closed loops whose rows repeat each other but for a small gap."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.risk import Risk

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings


def concerns(model: CompiledScene) -> bool:
    """Whether rows that are left out leave more than rounding."""
    return model.closed is not None and model.closed.loops.misfit[0] > 0.0


def loop_misfit_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """What such a row asks is left out, for met exactly it would lock."""
    assert model.closed is not None
    gap, name, direction = model.closed.loops.misfit
    yield Risk(
        "nearly-redundant", f'"{name}"',
        f"its direction {direction} repeats what others do but for a gap of {gap:.1e} (m, rad); it "
        "is left out, for met exactly it would lock the mechanism",
        "make the axes and lengths of the loop agree, or say what bends in it, by a bushing or a "
        "flexible body", before=True,
    )  # fmt: skip
