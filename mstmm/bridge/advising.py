"""The smallest sufficient model of a scene: compiles what `runtime.advice` tries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..defaults import ADVICE_SAMPLES, CHART_BUDGET, CHART_ERROR, CHART_ROUNDS
from ..errors import SceneError
from ..scene import Scene
from .compilation import compile_level, compile_scene

if TYPE_CHECKING:
    from ..runtime.advice.record import Advice
    from ..runtime.model.model import Model


def advise(
    scene: Scene | Model,
    t_end: float = 10.0,
    *,
    error: float = CHART_ERROR,
    of: str | Sequence[str] = (),
    budget: float = CHART_BUDGET,
    samples: int = ADVICE_SAMPLES,
    rounds: int = CHART_ROUNDS,
    engine: str = "looped",
    progress: Callable[[str], None] | None = None,
    state: Callable[[str], None] | None = None,
) -> Advice:
    """The smallest model of a scene that errs by no more than what is asked.

    Args:
        scene: a scene, or a model of one.
        t_end: end of the run that the advice is for, s.
        error: largest error wanted, above 0; below 1 unless it is that of one quantity.
        of: quantity or quantities whose error is meant, of one in its unit, of several each in
            parts of its largest excursion; otherwise the places of all bodies and ends, in parts of
            the length of the scene.
        budget: s of the clock that the runs may take.
        samples: times from 0 to t_end at which errors are looked at; the largest counts.
        rounds: how often processor times are taken again.
        engine: as in `compile`, for all that is compiled here.
        progress: called with a sentence before every run.
        state: called with what is compared, and over what time.

    A run in which bodies deform one way tells what each of them may be; the models that follow
    from it are run beside the richest one, whole or over a window where that takes too long, until
    nothing less suffices.  Errors are against the richest model; `BodyAdvice.split` says where that
    is too little itself.

    Raises SceneError for arguments that make no sense, NumericalFailure for a scene that does not
    run, or whose motion cannot be told to within what is asked.
    """
    from ..runtime.advice.advising import advised
    from ..runtime.advice.request import request

    asked = request(t_end, error, of, budget, samples, rounds)

    def compiled(one: Scene) -> Model:
        return compile_level(one, engine=engine)

    if isinstance(scene, Scene):
        model = compile_scene(scene, engine=engine)
    elif hasattr(scene, "simulate"):
        model = scene
    else:
        raise SceneError(f"scene = {scene!r:.60}: expected a Scene, or a Model of one")
    return advised(model, asked, compiled, progress or _quiet, state or _quiet)


def _quiet(_: str) -> None:
    """Nobody listens."""
