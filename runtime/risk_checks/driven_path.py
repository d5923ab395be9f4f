"""States known before a run: driven coordinates over time, the others at the start."""

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

#: Number of times at which drives are evaluated.
_DRIVE_TIMES = 65

_NO_STATISTICS = Statistics(0, 0, 0, 0, None, None, None, None, 0.0, 0.0, False, 0)


def drive_times(model: CompiledScene, settings: Settings) -> list[float]:
    """Times (s) of a run at which drives are evaluated; the start only without drives."""
    moves = model.packed_scene.system.driven and settings.t_end > settings.t_start
    return np.linspace(settings.t_start, settings.t_end, _DRIVE_TIMES if moves else 1).tolist()


def driven_states(
    model: CompiledScene, settings: Settings, q: Array, u: Array, at: Sequence[float]
) -> Trajectory:
    """States at the times `at` (s) in which only driven coordinates move, as a trajectory."""
    system, n = SceneSystem(model.looped), len(at)
    start = system.start(settings.t_start, q, u)
    t = np.array(at, dtype=float)
    samples = Samples(
        t, np.tile(start, (n, 1)), np.tile(system.memory, (n, 1)), np.zeros(n, dtype=np.int64)
    )
    return split(
        system, samples, replace(settings, output_times=None), Status.FINISHED, "",
        _NO_STATISTICS, (settings.t_start, start),
    )  # fmt: skip
