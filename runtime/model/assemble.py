"""States of a model brought to where its loops are closed."""

from __future__ import annotations

from collections.abc import Sequence

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.scene.rules.messages import near

from ..engine.compiled import Compiled
from ..engine.loops.calls import LoopCalls


def assemble(compiled: Compiled, q: Array, u: Array, hold: Sequence[str]) -> tuple[Array, Array]:
    """See `Model.assemble`."""
    hinges = compiled.layout.hinges
    for name in hold:
        if name not in hinges:
            raise SceneError(f'hold: there is no hinge "{name}"{near(name, list(hinges))}')
    if compiled.closed is None:
        return q.copy(), u.copy()
    q, u = LoopCalls(compiled.looped, q).driven(q, u)
    fast = [
        hinge.name for hinge in compiled.packed.described.hinge
        if not hinge.is_weld and hinge.drive is None and u[hinges[hinge.name].u_slice].any()
    ]  # fmt: skip
    return compiled.closed.assembled(q, u, hold, fast)
