"""Assembly of a model: nearest states that satisfy all constraints."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Self

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.risk import AssessedResult, DeferredRisks, Risk
from mstmm.scene.validators.validation_messages import did_you_mean

from ..engine.compiled_scene import CompiledScene
from ..engine.loops.loop_analysis import LoopStart
from ..engine.loops.loop_calls import LoopCalls
from ..risk_checks.state_risks import find_state_risks


class Assembly(AssessedResult, tuple[Array, Array]):
    """Closed state (q, u) with findings about it."""

    findings: Iterable[Risk]

    def __new__(cls, model: CompiledScene, t: float, q: Array, u: Array) -> Self:
        """The state q (nq,), u (nu,) of a model at t (s)."""
        assembly = super().__new__(cls, (q, u))
        assembly.findings = DeferredRisks(lambda: find_state_risks(model, t, q, u))
        return assembly

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
    """Nearest closed state, see `Model.assemble`; hinges `fast` keep their speeds (None: all)."""
    hold, hinges = _held_hinges(compiled, hold), compiled.coordinate_layout.hinges
    if compiled.loop_start is None:
        return Assembly(compiled, t, q.copy(), u.copy())
    q, u = LoopCalls(compiled.looped, q, t=t).driven_state(q, u)
    moving = [
        hinge.name for hinge in compiled.packed_scene.user_scene.hinge
        if not hinge.is_weld and hinge.drive is None and u[hinges[hinge.name].u_slice].any()
    ]  # fmt: skip
    if sum(hinges[name].nu for name in moving) > compiled.loop_start.loops.mobility:
        moving = []  # a complete state: only as many speeds as the mobility can be kept
    fast = moving if fast is None else fast
    if branch is None:
        state = compiled.loop_start.assemble_nearest(q, u, hold, fast, t)
    else:
        start = compiled.loop_start.follow_branch(
            _branch_coordinates(compiled.loop_start, branch), q, hold, t
        )
        state = compiled.loop_start.assemble(start, u, hold, fast, t)
    return Assembly(compiled, t, *state)


def assemble_path(compiled: CompiledScene, q: Array, hold: Sequence[str], branch: int) -> Array:
    """Closed states along a path of held coordinates; see `Model.assemble_path`."""
    hold = _held_hinges(compiled, hold)
    if compiled.loop_start is None:
        return q.copy()
    state, states = _branch_coordinates(compiled.loop_start, branch), np.empty_like(q)
    for k, row in enumerate(q):
        target = LoopCalls(compiled.looped, row).driven_state(row, np.zeros(compiled.nu))[0]
        states[k] = state = compiled.loop_start.follow_branch(state, target, hold)
    return states


def _branch_coordinates(closed: LoopStart, number: int) -> Array:
    """Coordinates q (nq,) of the branch with a given number."""
    count = len(closed.branches)
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < count:
        raise SceneError(f"branch = {number!r:.60}: expected 0 to {count - 1}, see loops.branches")
    return closed.branches[number].q


def _held_hinges(compiled: CompiledScene, hold: Sequence[str]) -> list[str]:
    """Names of the hinges in `hold`; raises SceneError for anything else."""
    hinges, modal = compiled.coordinate_layout.hinges, compiled.coordinate_layout.modal
    if isinstance(hold, str) or not isinstance(hold, Collection):
        raise SceneError(f"hold = {hold!r:.60}: expected a list of names of hinges")
    for name in hold:
        if not isinstance(name, str):
            raise SceneError(f"hold = {hold!r:.60}: expected names of hinges")
        if name not in hinges or name in modal:
            raise SceneError(f'hold: there is no hinge "{name}"{did_you_mean(name, list(hinges))}')
    return [hinges[name].name for name in hold]
