"""Starts whose motion the masses leave undetermined: every hinge concerned, and what would help.

The sweep stops at the first hinge whose motion moves no inertia.  Given a rotor's inertia there it
goes on to the next, which is both how all of them are found and the remedy that is named: what
moves no inertia passes nothing inwards, so that the rotor changes nothing for the others.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError, UndeterminedMotionError

from ..packing.records.trial_rotors import rotors

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..engine.looped_engine import LoopedEngine


#: Hinges that are looked for, and that are named, at most.
_MOST, _NAMED = 50, 8


def refuse_undetermined_start(model: CompiledScene, q: Array, u: Array) -> None:
    """SceneError naming the hinges if the masses leave motions of the start undetermined."""
    engine = model.looped
    start = (q[None].copy(), u[None].copy(), engine.start_memory()[None].copy())
    try:
        engine.accelerations(0.0, *start)
    except UndeterminedMotionError as error:
        places, said = _concerned(engine, error, start), str(error)
    except NumericalFailure:
        return  # not a matter of masses: reported by whoever computes there
    else:
        return
    if len(places) > 1:
        said = (
            f"{_listed([engine.hinge_name(k) for k in sorted(places)])} at t = 0 s: motions of "
            "them are undetermined, because what they carry has no positive inertia in that "
            "direction (thin rods on balls, point masses, collinear axes, three angles at their "
            "lock, negative principal moments); give the bodies inertia, give the hinges rotor "
            "inertia (law.inertia), fix those motions, or take ball hinges for three angles"
        )
    raise SceneError(f"scene: {said}")


def _concerned(
    engine: LoopedEngine, error: UndeterminedMotionError, start: tuple[Array, Array, Array]
) -> list[int]:
    """Places in the tree of all hinges with an undetermined motion, that of the error first."""
    places = [error.place]
    with rotors(engine.packed.written) as give:
        while len(places) < _MOST and not engine.is_flexible(places[-1]):
            give(places[-1])
            try:
                engine.accelerations(0.0, *start)
            except UndeterminedMotionError as following:
                if following.place in places:
                    break
                places.append(following.place)
            except NumericalFailure:
                break
            else:
                break
    return places


def _listed(names: list[str]) -> str:
    """hinges "a", "b" and "c"; of many the first, and how many more."""
    shown = [f'"{name}"' for name in names[:_NAMED]]
    rest = len(names) - len(shown)
    if rest:
        shown.append(f"{rest} more" if len(names) < _MOST else f"more than {rest - 1} others")
    if len(shown) < 2:
        return f"hinge {''.join(shown)}"
    return f"hinges {', '.join(shown[:-1])} and {shown[-1]}"
