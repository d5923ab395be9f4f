"""Advice on the smallest sufficient model of a scene; compiles the models that are compared."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..defaults import ADVICE_SAMPLES, CHART_BUDGET, CHART_ERROR, CHART_ROUNDS
from ..errors import SceneError
from ..scene import Scene
from .compilation import compile_level, compile_scene

if TYPE_CHECKING:
    from ..runtime.experiments.model_reduction.advice import Advice
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
    """Find the smallest model of a scene whose error does not exceed the target error.

    Args:
        scene: a scene, or a model of one.
        t_end: end of the run that the advice is for, s.
        error: target error, above 0; below 1 unless it is that of one quantity.
        of: quantity or quantities that the error refers to: one in its unit, several each relative
            to its largest excursion.  Default: the positions of all bodies and ends, relative to
            the length of the scene.
        budget: wall-clock time limit of the runs, s.
        samples: number of output times from 0 to t_end for the error; the largest error counts.
        rounds: repetitions of the measurement of CPU times.
        engine: as in `compile`, for all models that are compiled here.
        progress: called with a sentence before every run.
        state: called with a description of the comparison and its time span.

    A run with one-way coupled bodies shows which levels each body may have.  The models that follow
    are compared with the richest one until no smaller one suffices, over the whole run, or over a
    window where that takes too long.  Errors are relative to the richest model; `BodyAdvice.split`
    reports bodies for which the richest model is not sufficient.

    Raises SceneError for invalid arguments, NumericalFailure for a scene that cannot be simulated,
    or whose motion cannot be determined to within the target error.
    """
    from ..runtime.experiments.model_reduction.advice_state import advice_request
    from ..runtime.experiments.model_reduction.advise import make_advice

    request_options = advice_request(t_end, error, of, budget, samples, rounds)

    def compile_scene_level(one: Scene) -> Model:
        return compile_level(one, engine=engine)

    if isinstance(scene, Scene):
        model = compile_scene(scene, engine=engine)
    elif hasattr(scene, "simulate"):
        model = scene
    else:
        raise SceneError(f"scene = {scene!r:.60}: expected a Scene, or a Model of one")
    return make_advice(
        model,
        request_options,
        compile_scene_level,
        progress or _ignore_message,
        state or _ignore_message,
    )


def _ignore_message(_: str) -> None:
    """Ignore a message: default of `progress` and `state`."""
