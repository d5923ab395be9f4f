"""Consistent starts: assembly of closed loops, and rejection of motions without inertia."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING, Self

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError, UndeterminedMotionError
from mstmm.risk import AssessedResult, DeferredRisks, Risk
from mstmm.scene.validators.validation_messages import did_you_mean

from ..engine.compiled_scene import CompiledScene
from ..engine.loops.loop_analysis import LoopStart
from ..engine.loops.loop_calls import LoopCalls
from ..packing.records.model_record import trial_rotors
from ..result.checks.answer_checks import find_state_risks

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..engine.looped_engine import LoopedEngine


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


# --- starts with motions that have no inertia -----------------------------------------------------

# The sweep stops at the first hinge whose motion moves no inertia.  With a trial rotor there, it
# continues to the next one, which finds all of them.  A motion without inertia transmits nothing
# inboard, so that the rotor does not change the others.  Rotor inertia is also the remedy that is
# suggested.

#: Largest number of hinges that are searched for, and that a message lists.
_MAX_HINGES, _MAX_NAMES = 50, 8


def check_start_determined(model: CompiledScene, q: Array, u: Array) -> None:
    """Raise SceneError, naming the hinges, if motions at the start have no inertia."""
    engine = model.looped
    start = (q[None].copy(), u[None].copy(), engine.start_memory()[None].copy())
    try:
        engine.accelerations(0.0, *start)
    except UndeterminedMotionError as error:
        places, message = _undetermined_hinges(engine, error, start), str(error)
    except NumericalFailure:
        return  # another cause: reported by later computations at this state
    else:
        return
    if len(places) > 1:
        message = (
            f"{_list_hinges([engine.hinge_name(k) for k in sorted(places)])} at t = 0 s: motions "
            "are undetermined, because the outboard bodies have no positive inertia along them "
            "(thin rods on ball hinges, point masses, collinear axes, gimbal lock of three angles, "
            "negative principal moments); give the bodies inertia, give the hinges rotor inertia "
            "(law.inertia), fix those motions, or use ball hinges instead of three angles"
        )
    raise SceneError(f"scene: {message}")


def _undetermined_hinges(
    engine: LoopedEngine, error: UndeterminedMotionError, start: tuple[Array, Array, Array]
) -> list[int]:
    """Tree indices of all hinges with an undetermined motion, that of the error first."""
    places = [error.place]
    with trial_rotors(engine.packed.written) as add_rotor:
        while len(places) < _MAX_HINGES and not engine.is_flexible(places[-1]):
            add_rotor(places[-1])
            try:
                engine.accelerations(0.0, *start)
            except UndeterminedMotionError as next_error:
                if next_error.place in places:
                    break
                places.append(next_error.place)
            except NumericalFailure:
                break
            else:
                break
    return places


def _list_hinges(names: list[str]) -> str:
    """Text such as: hinges "a", "b" and "c"; of many names the first, and the number of others."""
    shown = [f'"{name}"' for name in names[:_MAX_NAMES]]
    more = len(names) - len(shown)
    if more:
        shown.append(f"{more} more" if len(names) < _MAX_HINGES else f"more than {more - 1} others")
    if len(shown) < 2:
        return f"hinge {''.join(shown)}"
    return f"hinges {', '.join(shown[:-1])} and {shown[-1]}"
