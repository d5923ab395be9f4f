"""Cost against accuracy of a scene: compiles its levels of model for `runtime.chart`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..defaults import CHART_BUDGET, CHART_ERROR, CHART_ROUNDS
from ..errors import SceneError
from ..scene import Scene
from .compilation import compile_level, compile_scene

if TYPE_CHECKING:
    from ..runtime.chart.chart import Chart
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
    """What accuracy costs: every method over its tolerances or steps, and which one to take.

    Args:
        scene: a scene, or a model of one.
        t_end: end of every run, s.
        quantities: names such as "rod.tip.position": errors are of this quantity in its unit, of
            several each in parts of its largest excursion; otherwise of all coordinates, or with
            `models` of the places of all bodies and ends, scaled as `reference.scaling` says.
        methods: names, one or more; otherwise every method that `simulate` knows.
        models: also every level of model of the flexible bodies: rigid, one-way, linear and
            stiffened with 1 to n shapes, planar where nothing leaves the plane.  Errors are then
            against the richest level.
        error: for which the cheapest setting is recommended.
        budget: s of the clock that the runs may take; what did not fit in is told.
        samples: how many even times from 0 to t_end errors are looked at; the largest counts.  By
            default 101, and up to three times as many beside them where the motion is so fast that
            a run takes several steps between two.
        rounds: how often the processor times are taken again, all points in turn.
        engine: as in `compile`, for what is compiled here; "auto" is "looped" with `models`, so
            that all levels run alike and no compiler takes the time.
        title: of the pictures.
        progress: called with a sentence before every run.
        state: called with the plan of the time, and with what the reference is.

    The reference is a run at tight tolerances that agrees with one of another method; its own error
    is stated, and points below three times that are marked.  A fixed step of which `simulate` says
    that it is too long is never recommended; what else runs warn of goes with their points.

    Where loops are closed, methods that do not follow them are left out, with the reason.

    Raises SceneError for arguments that make no sense, NumericalFailure where no reference is found
    within its part of the budget.
    """
    from ..runtime.chart.charting import charted, request

    asked = request(t_end, quantities, methods, models, error, budget, samples, rounds)

    chosen = "looped" if models and engine == "auto" else engine

    def compiled(one: Scene) -> Model:
        return compile_level(one, engine=chosen)

    if isinstance(scene, Scene):
        model = compile_scene(scene, engine=chosen)
    elif hasattr(scene, "simulate"):
        model = scene
    else:
        raise SceneError(f"scene = {scene!r:.60}: expected a Scene, or a Model of one")
    return charted(model, asked, compiled, title, progress or _quiet, state or _quiet)


def _quiet(_: str) -> None:
    """Nobody listens."""
