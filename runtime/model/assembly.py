"""States of a model brought to where its loops are closed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Self

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.risk import AssessedAnswer, DeferredRisks, Risk
from mstmm.scene.validators.validation_messages import did_you_mean

from ..engine.compiled_scene import CompiledScene
from ..engine.loops.loop_analysis import LoopStart
from ..engine.loops.loop_calls import LoopCalls
from ..risk_checks.answers import find_state_risks


class Assembly(AssessedAnswer, tuple[Array, Array]):
    """(q, u) of a closed state, and how far it can be trusted."""

    findings: Iterable[Risk]

    def __new__(cls, model: CompiledScene, t: float, q: Array, u: Array) -> Self:
        """The state q (nq,), u (nu,) of a model at t (s)."""
        made = super().__new__(cls, (q, u))
        made.findings = DeferredRisks(lambda: find_state_risks(model, t, q, u))
        return made

    def __reduce__(self) -> tuple[type[tuple[Array, Array]], tuple[tuple[Array, Array]]]:
        return tuple, ((self[0], self[1]),)


def assemble(
    compiled: CompiledScene,
    q: Array,
    u: Array,
    hold: Sequence[str],
    fast: Collection[str] | None,
    t: float,
    branch: int | None = None,
) -> Assembly:
    """See `Model.assemble`; speeds of the hinges `fast` stay, of all that have some if None."""
    hold, hinges = _names(compiled, hold), compiled.layout.hinges
    if compiled.closed is None:
        return Assembly(compiled, t, q.copy(), u.copy())
    q, u = LoopCalls(compiled.looped, q, t=t).driven(q, u)
    moving = [
        hinge.name for hinge in compiled.packed.described.hinge
        if not hinge.is_weld and hinge.drive is None and u[hinges[hinge.name].u_slice].any()
    ]  # fmt: skip
    if sum(hinges[name].nu for name in moving) > compiled.closed.loops.mobility:
        moving = []  # a whole state: no more than its freedoms can be kept
    fast = moving if fast is None else fast
    if branch is None:
        found = compiled.closed.nearest(q, u, hold, fast, t)
    else:
        there = compiled.closed.led(_on_branch(compiled.closed, branch), q, hold, t)
        found = compiled.closed.assembled(there, u, hold, fast, t)
    return Assembly(compiled, t, *found)


def assemble_path(compiled: CompiledScene, q: Array, hold: Sequence[str], branch: int) -> Array:
    """See `Model.assemble_path`."""
    hold = _names(compiled, hold)
    if compiled.closed is None:
        return q.copy()
    here, found = _on_branch(compiled.closed, branch), np.empty_like(q)
    for k, row in enumerate(q):
        to = LoopCalls(compiled.looped, row).driven(row, np.zeros(compiled.nu))[0]
        found[k] = here = compiled.closed.led(here, to, hold)
    return found


def _on_branch(closed: LoopStart, number: int) -> Array:
    """q (nq,) of a branch by its number."""
    count = len(closed.branches)
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < count:
        raise SceneError(f"branch = {number!r:.60}: expected 0 to {count - 1}, see loops.branches")
    return closed.branches[number].q


def _names(compiled: CompiledScene, hold: Sequence[str]) -> list[str]:
    """Names of hinges that are held; SceneError for what names none."""
    hinges, modal = compiled.layout.hinges, compiled.layout.modal
    if isinstance(hold, str) or not isinstance(hold, Collection):
        raise SceneError(f"hold = {hold!r:.60}: expected a list of names of hinges")
    for name in hold:
        if not isinstance(name, str):
            raise SceneError(f"hold = {hold!r:.60}: expected names of hinges")
        if name not in hinges or name in modal:
            raise SceneError(f'hold: there is no hinge "{name}"{did_you_mean(name, list(hinges))}')
    return [hinges[name].name for name in hold]
