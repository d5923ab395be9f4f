"""What several cases measure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import NumericalFailure
from ..runtime.model.model import Model
from ..runtime.result.result import Result


def finished(run: Result) -> Result:
    """The run, if it came to its end.  Raises NumericalFailure with its message otherwise."""
    if not run.success:
        raise NumericalFailure(run.message)
    return run


def simulated(model: Model, *args: Any, **options: Any) -> Result:
    """A run to its end.  Raises NumericalFailure if there is none."""
    return finished(model.simulate(*args, **options))


def correction(model: Model, states: Iterable[tuple[Array, Array]]) -> float:
    """What a step of iterative refinement changes of the accelerations, as a part of the largest:
    to its leading digits their error.  The worst of some states (q, u).

    Their residual comes from inverse dynamics, which eliminates nothing, and is solved for by the
    Riccati sweep (Higham, Accuracy and Stability of Numerical Algorithms, 2002, ch. 12).
    """
    worst = 0.0
    for q, u in states:
        udot = model.accelerations(q, u)
        change = model.solve(q, model.inverse_dynamics(q, u, udot))
        worst = max(worst, float(np.abs(change).max() / np.abs(udot - change).max()))
    return worst
