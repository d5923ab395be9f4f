"""Mechanisms that begin where their motion branches."""

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
    """Whether loops begin in a singular pose, and speeds of some hinges are not given."""
    if model.closed is None or not model.closed.loops.singular:
        return False
    hinges = [hinge for hinge in model.packed.described.hinge if not hinge.is_weld]
    return any(hinge.drive is None and hinge.name not in model.closed.fast for hinge in hinges)


def singular_start_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """There the start's speeds decide, and few of them do not say which way."""
    assert model.closed is not None
    if not np.array_equal(q, model.closed.start[0]):
        return
    hinge = model.closed.loops.redundant[0][0]
    yield Risk(
        "branching-start", f'hinge "{hinge}"',
        "the loops begin in a singular pose, from which the mechanism can go on in more ways than "
        "one; speeds that are not all given may belong to none of them",
        "give the speeds of all hinges (initial.u) as they are on the way that is meant, or begin "
        "elsewhere", before=True,
    )  # fmt: skip
