"""Builder of the certificate of a run."""

from __future__ import annotations

import numpy as np

from ..integrate.c_loop import Statistics
from ..run.error_estimate import ErrorEstimate
from ..run.step_stability import check_later
from . import spring_deflection
from .certificate import Certificate
from .conditioning import MAX_CHECKED_BODIES, pivot_loss, singular_distance
from .conservation import energy_drift, momentum_drifts
from .flexible import model_range
from .loop_closure_error import loop_closure
from .narrow_features import missed_feature_risks
from .result_record import Record
from .result_risks import output_risks
from .sources.contacts import find_pulling_contacts
from .step_control import step_control


def build_certificate(result: Record, error: ErrorEstimate | None) -> Certificate:
    """Build the certificate of a result; `error` is the estimate of a second run."""
    run, statistics = result.trajectory, result.statistics
    return Certificate(
        energy=energy_drift(result),
        momentum=tuple(momentum_drifts(result)),
        quaternion_drift=run.norm_residual,
        pivot_loss=pivot_loss(result.model, run),
        singularity_distance=singular_distance(result.model, run),
        step_stability=result._step,
        later_step_stability=check_later(result.model.looped, run),
        stability_limited=(
            statistics is not None and statistics.stability_limited and not run.methods
        ),
        sum_of_local_errors=_finite_local_error_sum(statistics),
        error=error,
        is_finite=bool(np.isfinite(run.q).all() and np.isfinite(run.u).all()),
        message=result.message,
        step_control=step_control(run.settings, run.achieved_error),
        pivots_not_checked=len(result.model.scene.bodies) > MAX_CHECKED_BODIES,
        sample_count=len(result.t),
        flexible_bodies=model_range.model_ranges(result._flexible),
        spring_deflection=spring_deflection.stiffest_spring_deflection(result),
        failures=() if result.success else (result.message,),
        model_risks=result._model_risks(),
        prior_risks=(
            *run.risks,
            *missed_feature_risks(result.model, run),
            *find_pulling_contacts(result),
            *output_risks(run, result.outputs()),
        ),
        achieved_error=run.achieved_error,
        loop_closure=loop_closure(result.model, run),
    )


def _finite_local_error_sum(statistics: Statistics | None) -> float | None:
    """Sum of local errors; None where it is not finite or there are no statistics."""
    total = None if statistics is None else statistics.sum_of_local_errors
    return total if total is not None and np.isfinite(total) else None
