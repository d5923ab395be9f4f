"""Which engine a run takes: code compiled for the scene where it is there or pays, else the loop.

The choice never looks at a clock.  A scene whose code is not there yet starts on the looped engine;
after so many steps the evaluations of the whole run are known well enough, and if compiling pays
the run starts again on compiled code, so that its numbers do not depend on when that was decided.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from mstmm.errors import EnvironmentFailure, SceneError

from ..integrate.steppers import get
from .scene_system import SceneCode

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.c_loop import Integrator
    from ..integrate.settings import Settings
    from ..kernels.fused_library import FusedLibrary

#: Evaluations after which the length of a run is foretold.
_LOOK_AFTER = 2000

LOOPED, FUSED = "looped", "fused"


def at_once(model: CompiledScene, settings: Settings, recorded: str | None) -> SceneCode | None:
    """SceneCode code for a run that starts now; None for the looped engine.

    Args:
        model: the model.
        settings: of the run.
        recorded: the engine of the run that is continued; None for a new one.

    Raises EnvironmentFailure if a run on compiled code is to be continued where there is none.
    """
    if recorded == LOOPED:
        return None
    library = model.fusion.library
    if library is None and recorded == FUSED:
        try:
            library = model.fusion.build()
        except (EnvironmentFailure, SceneError) as error:
            raise EnvironmentFailure(
                f"the run began on compiled code, which cannot be had now ({error}); "
                "run without resume to start again"
            ) from None
    return None if library is None else _compiled(model, settings, library, math.inf)


def for_many(model: CompiledScene, settings: Settings) -> SceneCode | None:
    """Code for steps without a known end, compiled where it is worth it for any number of them."""
    library = model.fusion.ready(math.inf)
    return None if library is None else _compiled(model, settings, library, math.inf)


def look_after(model: CompiledScene, settings: Settings) -> int:
    """Steps of a looped run after which `worth_compiling` is to be asked; 0 for never."""
    if model.fusion.obstacle:
        return 0
    return math.ceil(_LOOK_AFTER / get(settings.first_method).n_stages)


def worth_compiling(model: CompiledScene, settings: Settings, run: Integrator) -> SceneCode | None:
    """SceneCode code if a looped run that has come so far is worth it."""
    gone = run.t - settings.t_start
    if not gone > 0.0:
        return None
    evaluations = run.statistics.evaluations * (settings.t_end - settings.t_start) / gone
    library = model.fusion.ready(evaluations)
    return None if library is None else _compiled(model, settings, library, evaluations)


def _compiled(
    model: CompiledScene, settings: Settings, library: FusedLibrary, evaluations: float
) -> SceneCode:
    """Lanes only for methods that have use for them; what implicit methods ask once one does."""
    fusion, iterated = model.fusion, get(settings.first_method).iterated is not None
    lanes = fusion.ready_lanes(evaluations) if iterated else None
    implicit = partial(fusion.ready_implicit, evaluations)
    return SceneCode(library, lanes, fusion.numbers, fusion.inputs, implicit)
