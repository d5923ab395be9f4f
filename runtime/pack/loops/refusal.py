"""What cannot be asked yet of scenes whose loops are closed, one message for all of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.errors import SceneError
from mstmm.scene.checks.topology import build

from .unknown import named_loop

if TYPE_CHECKING:
    from ..packed import Packed

#: What does follow closed loops.
INSTEAD = "accelerations and simulate with dop853, dopri5 or rk4 do"


def refuse(packed: Packed, what: str, instead: str) -> None:
    """SceneError where loops are closed, which `what` cannot follow; `instead` does."""
    if not packed.system.closures:
        return
    plan = build(packed.described).plan
    assert plan is not None
    raise SceneError(
        f"scene: {named_loop(packed.described, plan)} is closed, and {what} cannot follow that "
        f"yet; {instead}"
    )
