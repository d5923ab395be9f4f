"""Work-precision chart of a scene; compiles its model levels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..defaults import CHART_BUDGET, CHART_ERROR, CHART_ROUNDS
from ..errors import SceneError
from ..scene import Scene
from .compilation import compile_level, compile_scene

if TYPE_CHECKING:
    from ..runtime.experiments.chart.chart import Chart
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
        quantities: names such as "rod.tip.position" that errors refer to: one quantity in its unit,
            several each relative to its largest excursion.  Default: all coordinates, or with
            `models` the positions of all bodies and ends, scaled as `reference.scaling` states.
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
        progress: called with a sentence before every run.
        state: called with the time plan, and with a description of the reference.

    The reference is a run at tight tolerances that agrees with a run of another method; its error
    is stated, and points below three times that error are marked.  A fixed step that `simulate`
    reports as too long is never recommended; other warnings of a run are kept with its point.

    For scenes with closed loops, methods that do not support them are left out, with the reason.

    Raises SceneError for invalid arguments, NumericalFailure if no reference is found within its
    part of the budget.
    """
    from ..runtime.experiments.chart.chart import chart_request, make_chart

    request_options = chart_request(
        t_end, quantities, methods, models, error, budget, samples, rounds
    )

    engine_name = "looped" if models and engine == "auto" else engine

    def compile_scene_level(one: Scene) -> Model:
        return compile_level(one, engine=engine_name)

    if isinstance(scene, Scene):
        model = compile_scene(scene, engine=engine_name)
    elif hasattr(scene, "simulate"):
        model = scene
    else:
        raise SceneError(f"scene = {scene!r:.60}: expected a Scene, or a Model of one")
    return make_chart(
        model,
        request_options,
        compile_scene_level,
        title,
        progress or _ignore_message,
        state or _ignore_message,
    )


def _ignore_message(_: str) -> None:
    """Ignore a message: default of `progress` and `state`."""
