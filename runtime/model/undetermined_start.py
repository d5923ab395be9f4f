"""Rejection of starts with motions that have no inertia, with all hinges concerned.

The sweep stops at the first hinge whose motion moves no inertia.  With a trial rotor there it goes
on to the next one, which finds all of them.  A motion without inertia transmits nothing inboard, so
that the rotor does not change the others.  Rotor inertia is also the remedy that is suggested.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError, UndeterminedMotionError

from ..packing.records.model_record import trial_rotors

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..engine.looped_engine import LoopedEngine


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
