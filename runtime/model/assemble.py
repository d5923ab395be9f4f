"""States of a model brought to where its loops are closed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Self

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.risk import Assessed, DeferredRisks, Risk
from mstmm.scene.rules.messages import near

from ..engine.compiled import Compiled
from ..engine.loops.calls import LoopCalls
from ..guard.answers import find_state_risks


class Assembly(Assessed, tuple[Array, Array]):
    """(q, u) of a closed state, and how far it can be trusted."""

    findings: Iterable[Risk]

    def __new__(cls, model: Compiled, t: float, q: Array, u: Array) -> Self:
        """The state q (nq,), u (nu,) of a model at t (s)."""
        made = super().__new__(cls, (q, u))
        made.findings = DeferredRisks(lambda: find_state_risks(model, t, q, u))
        return made

    def __reduce__(self) -> tuple[type[tuple[Array, Array]], tuple[tuple[Array, Array]]]:
        return tuple, ((self[0], self[1]),)


def assemble(
    compiled: Compiled,
    q: Array,
    u: Array,
    hold: Sequence[str],
    fast: Collection[str] | None,
    t: float,
) -> Assembly:
    """See `Model.assemble`; speeds of the hinges `fast` stay, of all that have some if None."""
    hinges, modal = compiled.layout.hinges, compiled.layout.modal
    if isinstance(hold, str) or not isinstance(hold, Collection):
        raise SceneError(f"hold = {hold!r:.60}: expected a list of names of hinges")
    for name in hold:
        if not isinstance(name, str):
            raise SceneError(f"hold = {hold!r:.60}: expected names of hinges")
        if name not in hinges or name in modal:
            raise SceneError(f'hold: there is no hinge "{name}"{near(name, list(hinges))}')
    hold = [hinges[name].name for name in hold]
    if compiled.closed is None:
        return Assembly(compiled, t, q.copy(), u.copy())
    q, u = LoopCalls(compiled.looped, q, t=t).driven(q, u)
    moving = [
        hinge.name for hinge in compiled.packed.described.hinge
        if not hinge.is_weld and hinge.drive is None and u[hinges[hinge.name].u_slice].any()
    ]  # fmt: skip
    if sum(hinges[name].nu for name in moving) > compiled.closed.loops.mobility:
        moving = []  # a whole state: no more than its freedoms can be kept
    found = compiled.closed.assembled(q, u, hold, moving if fast is None else fast, t)
    return Assembly(compiled, t, *found)
