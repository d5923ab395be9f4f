"""States before a run: drives as they will be, everything else as it starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mstmm.array_validation import Array

from ..engine.compiled_scene import CompiledScene
from ..integrate.c_loop import Samples, Statistics, Status
from ..integrate.settings import Settings
from ..run.integration_run import split
from ..run.scene_system import SceneSystem
from ..run.trajectory import Trajectory

#: Times at which drives are looked at.
_TIMES = 65

_NOTHING = Statistics(0, 0, 0, 0, None, None, None, None, 0.0, 0.0, False, 0)


def drive_times(model: CompiledScene, settings: Settings) -> list[float]:
    """The start, and times up to the end (s) where there are drives."""
    moves = model.packed.system.driven and settings.t_end > settings.t_start
    return np.linspace(settings.t_start, settings.t_end, _TIMES if moves else 1).tolist()


def driven_states(
    model: CompiledScene, settings: Settings, q: Array, u: Array, at: Sequence[float]
) -> Trajectory:
    """The states at some times (s) if only what is driven moved, as a trajectory."""
    system, n = SceneSystem(model.looped), len(at)
    start = system.start(settings.t_start, q, u)
    t = np.array(at, dtype=float)
    samples = Samples(
        t, np.tile(start, (n, 1)), np.tile(system.memory, (n, 1)), np.zeros(n, dtype=np.int64)
    )
    still = replace(settings, output_times=None)
    return split(system, samples, still, Status.FINISHED, "", _NOTHING, (settings.t_start, start))
