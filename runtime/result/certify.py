"""Builder of the certificate of a run."""

from __future__ import annotations

import numpy as np

from ..integrate.loop import Statistics
from ..run.error_estimate import ErrorEstimate
from ..run.stability import check_later
from . import gives
from .balances import energy, momentum
from .certificate import Certificate
from .closure import closure
from .conditioning import LARGEST, pivot_loss, singular_distance
from .control import control
from .flexible import certify
from .narrow import passed_over
from .owners.contacts import find_pulling_contacts
from .record import Record
from .risks import of_outputs


def certificate(result: Record, error: ErrorEstimate | None) -> Certificate:
    """Build the certificate of a result; `error` is the estimate of a second run."""
    run, statistics = result.trajectory, result.statistics
    return Certificate(
        energy=energy(result),
        momentum=tuple(momentum(result)),
        quaternion_residual=run.norm_residual,
        pivot=pivot_loss(result.model, run),
        singular=singular_distance(result.model, run),
        step=result._step,
        later=check_later(result.model.looped, run),
        stability_limited=(
            statistics is not None and statistics.stability_limited and not run.methods
        ),
        sum_of_local_errors=_local_errors(statistics),
        error=error,
        finite=bool(np.isfinite(run.q).all() and np.isfinite(run.u).all()),
        end=result.message,
        control=control(run.settings, run.reached),
        too_large=len(result.model.scene.bodies) > LARGEST,
        samples=len(result.t),
        flexible=certify.flexibilities(result._flexible),
        give=gives.stiffest(result),
        failures=() if result.success else (result.message,),
        models=result._outside(),
        known=(
            *run.risks,
            *passed_over(result.model, run),
            *find_pulling_contacts(result),
            *of_outputs(run, result.outputs()),
        ),
        reached=run.reached,
        closure=closure(result.model, run),
    )


def _local_errors(statistics: Statistics | None) -> float | None:
    """Sum of local errors; None where it is not finite or there are no statistics."""
    total = None if statistics is None else statistics.sum_local_error
    return total if total is not None and np.isfinite(total) else None
