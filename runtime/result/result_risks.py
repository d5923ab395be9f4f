"""Findings from the numbers of a run: overflow, drift, quaternion length."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import RUN, Risk

from ..integrate.achieved_error import AchievedError
from ..run.trajectory import Trajectory
from .certificate_data import Drift
from .loop_closure_error import MISFIT_REMEDY, MISFIT_RISK, Closure
from .step_control import StepControl

#: Deviation of a quaternion's length from 1 that is a risk.
MAX_LENGTH_ERROR = 1e-3


def finiteness_risks(finite: bool, reached: AchievedError | None) -> Iterator[Risk]:
    """Findings: states that are not finite, and a target error that was not achieved."""
    if not finite:
        yield Risk(
            "not-finite", RUN, "some states are not finite",
            "use smaller steps or tolerances, or find the quantity that grows without bound",
        )  # fmt: skip
    if reached is not None and reached.risk is not None:
        yield reached.risk


def output_risks(run: Trajectory, outputs: Mapping[str, Array]) -> Iterator[Risk]:
    """Findings: outputs that are not finite at finite states."""
    if not len(run.t):
        return
    is_state_finite = np.asarray(np.isfinite(np.hstack([run.q, run.u])).all(axis=1))
    for name, values in outputs.items():
        is_invalid = is_state_finite & ~np.isfinite(values.reshape(len(run.t), -1)).all(axis=1)
        if is_invalid.any():
            first_time = float(run.t[int(np.argmax(is_invalid))])
            yield Risk(
                "not-finite",
                f'output "{name}"',
                f'output "{name}" is not finite at {int(is_invalid.sum())} of {len(run.t)} '
                f"samples, first at t = {first_time:.6g} s",
                "keep divisors and the arguments of roots and logarithms within their range",
            )


def balance_risks(
    drifts: Sequence[Drift], control: StepControl, closure: Closure | None = None
) -> Iterator[Risk]:
    """Findings: energy and momentum that are unknown, or drift more than steps explain."""
    has_misfit = closure is not None and closure.misfit > 0
    for drift in drifts:
        if not drift.is_known:
            yield Risk(
                _drift_risk_name(drift), drift.name,
                f"the drift of {drift.name} is unknown: overflow, or no sample can be evaluated",
                "use smaller steps or tolerances, or find the quantity that grows without bound",
            )  # fmt: skip
    for drift in drifts:
        if drift.relative > control.bound:
            yield Risk(
                _drift_risk_name(drift),
                drift.name,
                f"{drift.name} is not conserved: it drifts by {drift}",
                MISFIT_REMEDY if has_misfit else control.finer(drift.relative),
                drift.relative,
                control.bound,
            )


def misfit_risks(closure: Closure | None, known: Sequence[Risk]) -> Iterator[Risk]:
    """Finding: a redundant row of a loop that is violated along the run, unless it is `known`."""
    is_known = any(risk.name == MISFIT_RISK for risk in known)
    if closure is None or is_known or not closure.misfit > 0:
        return
    yield Risk(
        MISFIT_RISK, closure.misfit_loop,
        f"a redundant row of {closure.misfit_loop} is violated by up to {closure.misfit:.1e} "
        "(m, rad) along the motion: the geometry of the loop does not fit exactly",
        MISFIT_REMEDY, closure.misfit,
    )  # fmt: skip


def quaternion_risks(residual: float) -> Iterator[Risk]:
    """Finding: quaternions far from unit length before normalisation."""
    if residual > MAX_LENGTH_ERROR:
        yield Risk(
            "quaternion-length", RUN,
            f"the length of quaternions differed from 1 by up to {residual:.1e} between steps: the "
            "error of attitudes is of the same size",
            "use smaller tolerances, or a method of the package", residual, MAX_LENGTH_ERROR,
        )  # fmt: skip


def _drift_risk_name(drift: Drift) -> str:
    return "energy-drift" if drift.unit == "J" else "momentum-drift"
