"""Result of a run: named, labelled quantities over time (first form: states and status)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .simulate import SceneSystem, Settings, Trajectory, advance, make_run, trajectory

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]


class Result:
    """States of a run; see `Trajectory`."""

    def __init__(self, model: Model, run: Trajectory) -> None:
        self.model, self.trajectory = model, run
        self.t, self.q, self.u = run.t, run.q, run.u
        self.success, self.message = run.success, run.message


def simulate(
    model: Model,
    settings: Settings,
    q: Array,
    u: Array,
    *,
    certify: bool,
    progress: Callable[[float, float], None] | None,
    checkpoint: str | None,
    resume: bool,
) -> Result:
    """One run."""
    system = SceneSystem(model._engine)
    run = make_run(system, settings, q, u)
    observe = None if progress is None else lambda r: progress(r.t, settings.t_end)
    status = advance(run, observe)
    return Result(model, trajectory(system, run, settings, status))
