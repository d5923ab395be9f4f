"""Choice of the engine of a run: fused code where it exists or pays, else the looped engine.

The choice never depends on a clock.  A scene without fused code starts on the looped engine.  After
a given number of steps the evaluations of the whole run are extrapolated; if compilation pays, the
run restarts on fused code, so that its results do not depend on when this was decided.
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
    from ..kernels.scene_libraries import FusedLibrary

#: Evaluations after which the evaluations of the whole run are extrapolated.
_EXTRAPOLATE_AFTER = 2000

LOOPED, FUSED = "looped", "fused"


def code_at_start(
    model: CompiledScene, settings: Settings, recorded: str | None
) -> SceneCode | None:
    """Fused code for a run that starts now; None for the looped engine.

    Args:
        model: the model.
        settings: of the run.
        recorded: engine of the run that is restarted from a checkpoint; None for a new run.

    Raises EnvironmentFailure if a run on fused code is to be restarted where no code can be built.
    """
    if recorded == LOOPED:
        return None
    library = model.fusion.library
    if library is None and recorded == FUSED:
        try:
            library = model.fusion.build()
        except (EnvironmentFailure, SceneError) as error:
            raise EnvironmentFailure(
                f"checkpoint: the run began on fused code, which cannot be compiled now ({error}); "
                "run without resume to start again"
            ) from None
    return None if library is None else _scene_code(model, settings, library, math.inf)


def code_for_any_length(model: CompiledScene, settings: Settings) -> SceneCode | None:
    """Fused code for a run of unknown length, compiled if that can pay at all; else None."""
    library = model.fusion.ready(math.inf)
    return None if library is None else _scene_code(model, settings, library, math.inf)


def steps_until_decision(model: CompiledScene, settings: Settings) -> int:
    """Steps of a looped run after which `code_if_it_pays` is to be called; 0 for never."""
    if model.fusion.obstacle:
        return 0
    return math.ceil(_EXTRAPOLATE_AFTER / get(settings.first_method).n_stages)


def code_if_it_pays(model: CompiledScene, settings: Settings, run: Integrator) -> SceneCode | None:
    """Fused code if compilation pays for a looped run, extrapolated from its time so far."""
    elapsed = run.t - settings.t_start
    if not elapsed > 0.0:
        return None
    evaluations = run.statistics.evaluations * (settings.t_end - settings.t_start) / elapsed
    library = model.fusion.ready(evaluations)
    return None if library is None else _scene_code(model, settings, library, evaluations)


def _scene_code(
    model: CompiledScene, settings: Settings, library: FusedLibrary, evaluations: float
) -> SceneCode:
    """Code with SIMD lanes only for iterated methods; implicit code is compiled on first use."""
    fusion, iterated = model.fusion, get(settings.first_method).iterated is not None
    lanes = fusion.ready_lanes(evaluations) if iterated else None
    implicit = partial(fusion.ready_implicit, evaluations)
    return SceneCode(library, lanes, fusion.numbers, fusion.inputs, implicit)
