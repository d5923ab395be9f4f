"""Experiments with the model levels of a scene: work-precision chart, smallest sufficient model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..defaults import ADVICE_SAMPLES, CHART_BUDGET, CHART_ERROR, CHART_ROUNDS
from ..errors import SceneError
from ..scene import Scene
from .compilation import compile_level, compile_scene

if TYPE_CHECKING:
    from ..runtime.experiments.chart.chart import Chart
    from ..runtime.experiments.model_reduction.advice import Advice
    from ..runtime.model.model import Model


def chart(
    scene: Scene | Model,
    t_end: float = 10.0,
    *,
    quantities: Sequence[str] = (),
    methods: Sequence[str] | None = None,
    models: bool = False,
    error: float = CHART_ERROR,
    budget: float = CHART_BUDGET,
    samples: int | None = None,
    rounds: int = CHART_ROUNDS,
    engine: str = "auto",
    title: str = "",
    progress: Callable[[str], None] | None = None,
    state: Callable[[str], None] | None = None,
) -> Chart:
    """Measure CPU time against error of every method, and recommend the cheapest setting.

    Args:
        scene: a scene, or a model of one.
        t_end: end of every run, s.
        quantities: names such as "rod.tip.position" that errors refer to, as `of` in `advise`.
            Default: all coordinates, or with `models` the positions of all bodies and ends, scaled
            as `reference.scaling` states.
        methods: names, one or more.  Default: every method of `simulate`.
        models: whether to include every model level of the flexible bodies: rigid, one-way, linear
            and stiffened with 1 to n shapes, planar where all motion stays in the plane.  Errors
            are then relative to the richest level.
        error: target error for which the cheapest setting is recommended.
        budget: wall-clock time limit of the runs, s; settings omitted for lack of time are listed.
        samples: number of equidistant output times from 0 to t_end for the error; the largest error
            counts.  Default: 101, with up to three times as many additional times where a run takes
            several steps between two of them.
        rounds: repetitions of the measurement of CPU times, each over all points.
        engine: as in `compile`, for models compiled here; "auto" is "looped" with `models`, so
            that all levels use the same engine and no time is spent on compilers.
        title: title of the plots.
        progress, state: called with a sentence before every run; with the time plan and the
            reference.

    The reference is a run at tight tolerances that agrees with a run of another method; its error
    is stated, and points below three times that error are marked.  A fixed step that `simulate`
    reports as too long is never recommended; other warnings of a run are kept with its point.
    Methods that do not support closed loops are left out for scenes that have some.

    Raises SceneError for invalid arguments, NumericalFailure if no reference is found within its
    part of the budget.
    """
    from ..runtime.experiments.chart.chart import chart_request, make_chart

    request = chart_request(t_end, quantities, methods, models, error, budget, samples, rounds)
    model, compile = _models(scene, "looped" if models and engine == "auto" else engine)
    return make_chart(model, request, compile, title, progress or _ignore, state or _ignore)


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
        progress, state: called with a sentence before every run; with the time span compared.

    A run with one-way coupled bodies shows which levels each body may have.  The models that follow
    are compared with the richest one until no smaller one suffices, over the whole run, or over a
    window where that takes too long.  Errors are relative to the richest model; `BodyAdvice.split`
    reports bodies for which the richest model is not sufficient.

    Raises SceneError for invalid arguments, NumericalFailure for a scene that cannot be simulated,
    or whose motion cannot be determined to within the target error.
    """
    from ..runtime.experiments.model_reduction.advice_state import advice_request
    from ..runtime.experiments.model_reduction.advise import make_advice

    request = advice_request(t_end, error, of, budget, samples, rounds)
    model, compile = _models(scene, engine)
    return make_advice(model, request, compile, progress or _ignore, state or _ignore)


def _models(scene: Scene | Model, engine: str) -> tuple[Model, Callable[[Scene], Model]]:
    """Model of a scene, unless it is one, and the function that compiles its model levels."""
    if isinstance(scene, Scene):
        model = compile_scene(scene, engine=engine)
    elif hasattr(scene, "simulate"):
        model = scene
    else:
        raise SceneError(f"scene = {scene!r:.60}: expected a Scene, or a Model of one")
    return model, lambda level: compile_level(level, engine=engine)


def _ignore(_: str) -> None:
    """Ignore a message: default of `progress` and `state`."""
