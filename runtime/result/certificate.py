"""Certificate of a run: measures, estimated error and verdict."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from mstmm.array_validation import finite_float
from mstmm.display import NotebookDisplay, table
from mstmm.plain_data import stored_as
from mstmm.risk import Risk, sentences

from ..integrate.achieved_error import AchievedError
from ..run.error_estimate import ANGLE, PART, ErrorEstimate, error_limit
from ..run.step_stability import StepCheck
from .certificate_data import (
    DEFAULT_ACCURACY,
    MAX_CHECKED_BODIES,
    Closure,
    Drift,
    PivotLoss,
    SingularDistance,
    SpringDeflection,
    StepControl,
)
from .flexible import exact_range, model_range
from .flexible.exact_range import ExactRange
from .flexible.model_range import ModelRange


@dataclass(frozen=True)
class Verdict:
    """Verdict on a result within given bounds.

    Attributes:
        objections: objections, one sentence each.
        unchecked: what was not checked.
        bounds: the requested bounds, in words.
    """

    objections: tuple[str, ...]
    unchecked: tuple[str, ...]
    bounds: str

    @property
    def trusted(self) -> bool:
        """Whether everything was checked and there is no objection."""
        return not self.objections and not self.unchecked

    def __str__(self) -> str:
        if self.objections:
            other_count = len(self.objections) - 1
            remainder = f" (and {other_count} more, see below)" if other_count else ""
            first_clause = re.split(r";|(?<=\)): |: split ", self.objections[0])[0]
            return f"NOT trusted: {first_clause}{remainder}"
        if self.unchecked:
            return f"not verified: {'; '.join(self.unchecked)}; no check objects"
        return f"trusted: {self.bounds}, all models within their validity range"


@dataclass(frozen=True)
class Certificate(NotebookDisplay):
    """Quality report of a run.

    Attributes:
        energy: residual of kinetic + potential energy - work (J), relative to the energy exchanged.
        momentum: drift of every conserved component of linear and angular momentum.
        quaternion_drift: largest | |quaternion| - 1 | in the samples before normalisation.
        pivot_loss: largest loss of digits in the sweep: about 1e-16 times its ratio.
        singularity_distance: closest approach to a coordinate singularity (gimbal).
        step_stability: fixed step compared with the fastest motion at the start; None for adaptive
            runs.
        later_step_stability: the same at the first sample for which the step is too long; None if
            there is none.
        stability_limited: whether stability, not accuracy, limited many of the steps; not available
            for runs that chose their methods themselves.
        sum_of_local_errors: in the mixed units of q and u; NOT the error of the result, which may
            be larger by any factor.
        error: estimate of the error from a second run; None unless requested (certify=True).
        is_finite: whether all values of q and u are finite.
        pivots_not_checked: whether the scene has too many bodies for a check of the pivots.
        sample_count: number of samples; balances need two.
        message: the run's own message.
        flexible_bodies: validity range of the model of each flexible body but exact beams.
        exact_beams: resolution and range of each exact beam.
        spring_deflection: deflection of the stiffest spring, which the estimated error does not
            include; None without a spring.
        failures: reasons why the run, or some of its samples, cannot be used at all.
        achieved_error: achieved error for a target error (error=...); None without a target.
        loop_closure: loop closure error, and the number of indeterminate reactions; None for trees.
        step_control: step control, which determines the expected drift of the balances.
        risks: findings about the run, objections first; empty for a clean run.
    """

    energy: Drift
    momentum: tuple[Drift, ...]
    quaternion_drift: float = field(metadata=stored_as("quaternion_residual"))
    pivot_loss: PivotLoss | None = field(metadata=stored_as("pivot"))
    singularity_distance: SingularDistance | None = field(metadata=stored_as("singular"))
    step_stability: StepCheck | None = field(metadata=stored_as("step"))
    stability_limited: bool
    sum_of_local_errors: float | None
    error: ErrorEstimate | None
    is_finite: bool = field(metadata=stored_as("finite"))
    message: str = field(metadata=stored_as("end"))
    step_control: StepControl = field(metadata=stored_as("control"))
    later_step_stability: StepCheck | None = field(default=None, metadata=stored_as("later"))
    pivots_not_checked: bool = field(default=False, metadata=stored_as("too_large"))
    sample_count: int = field(default=2, metadata=stored_as("samples"))
    flexible_bodies: tuple[ModelRange, ...] = field(default=(), metadata=stored_as("flexible"))
    exact_beams: tuple[ExactRange, ...] = field(default=(), metadata=stored_as("exact"))
    spring_deflection: SpringDeflection | None = field(default=None, metadata=stored_as("give"))
    failures: tuple[str, ...] = ()
    achieved_error: AchievedError | None = field(default=None, metadata=stored_as("reached"))
    loop_closure: Closure | None = field(default=None, metadata=stored_as("closure"))
    risks: tuple[Risk, ...] = ()

    def verdict(self, accuracy: float = DEFAULT_ACCURACY, balance: float | None = None) -> Verdict:
        """Verdict on whether the result can be used.

        Within `accuracy` (error in rad; for coordinates other than angles, relative to their range)
        and `balance` (relative, of energy and momentum; None for the bound of the run's own
        tolerance or step).
        """
        balance_bound = self.step_control.bound
        if balance is not None:
            balance_bound = finite_float("balance", balance, "a number")
        accuracy = finite_float("accuracy", accuracy, "a number in rad")
        objections = list(self.failures) + [
            f"{d.name} drifts by {d}, more than the requested bound {balance_bound:g}"
            for d in (self.energy, *self.momentum)
            if balance_bound < d.relative <= self.step_control.bound
        ]
        missing = []
        if self.sample_count < 2:
            missing.append(
                "the run has only one sample, so that energy and momentum cannot be compared"
            )
        if self.error is not None:
            objections += _error_objections(self.error, accuracy)
        elif self.achieved_error is None:
            missing.append("the error was not estimated (use certify=True)")
        objections += self.objections
        bounds = f"errors within {accuracy:g} rad or {accuracy:.3g} of the motion"
        if self.achieved_error is not None:
            bounds = f"error of {self.achieved_error.quantity} as requested"
        bounds = f"{bounds}, balances within {balance_bound:g}"
        return Verdict(tuple(dict.fromkeys(objections)), tuple(missing), bounds)

    @property
    def trusted(self) -> bool:
        """Whether balances, error and models were checked and stay within bounds."""
        return self.verdict().trusted

    @property
    def objections(self) -> tuple[str, ...]:
        """Objections to the result, one sentence each."""
        return sentences(risk for risk in self.risks if risk.invalidates)

    @property
    def warnings(self) -> tuple[str, ...]:
        """All findings, one sentence each."""
        return sentences(self.risks)

    @property
    def predictable_until(self) -> float | None:
        """Time (s) after which two accurate runs diverge; None without divergence or second run."""
        return None if self.error is None else self.error.divergence_time

    @property
    def error_scope(self) -> str:
        """Scope of the error estimate, and what it does not include."""
        parts = ["integration in time only, not the assumptions of the scene"]
        if self.flexible_bodies:
            parts.append("not the shape functions and frames of flexible bodies (see their rows)")
        if self.exact_beams:
            parts.append("not the strain shapes of exact beams (see their rows)")
        if self.spring_deflection is not None:
            stiffest = self.spring_deflection
            parts.append(
                "not the deflection of springs that replace constraints: up to "
                f"{stiffest.largest:.1e} m at the stiffest, {stiffest.spring}"
            )
        return "; ".join(parts)

    def __str__(self) -> str:
        return self.as_text()

    def as_text(self, verdict: bool = True, warnings: bool = True) -> str:
        """Certificate as text, one line per name; the verdict first."""
        rows = self.as_pairs(verdict, warnings)
        width = max(len(name) for name, _ in rows)
        return "\n".join(f"{name.ljust(width)}  {text}" for name, text in rows)

    def _plain_text(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return table(self.as_pairs())

    def as_pairs(self, verdict: bool = True, warnings: bool = True) -> list[tuple[str, str]]:
        """Certificate as pairs (name, text)."""
        not_determined = "not determined: the run has only one sample; give more output times"
        rows = [("verdict", str(self.verdict()))] if verdict else []
        rows.append(("run", self.message))
        if self.sample_count > 1:
            rows.append(("energy balance", str(self.energy)))
            rows += [(d.name, str(d)) for d in self.momentum]
        else:
            rows.append(("energy balance", not_determined))
        if self.quaternion_drift:
            rows.append(("quaternion length", f"within {self.quaternion_drift:.1e} of 1"))
        if self.loop_closure is not None:
            rows.append(("closed loops", str(self.loop_closure)))
        if self.pivot_loss is not None:
            pivot = self.pivot_loss
            rows.append(("pivot ratio", f'{pivot.ratio:.1e} at hinge "{pivot.hinge}"'))
        elif self.pivots_not_checked:
            rows.append(("pivot ratio", f"not computed for more than {MAX_CHECKED_BODIES} bodies"))
        if self.singularity_distance is not None:
            singular = self.singularity_distance
            rows.append(("singular angle", f'{singular.measure:.1e} at "{singular.hinge}"'))
        if self.step_stability is not None:
            rows.append(("h |lambda| at the start", f"{self.step_stability.product:.3g}"))
        if self.sum_of_local_errors is not None:
            rows.append(("sum of local errors", f"{self.sum_of_local_errors:.1e} (not the error)"))
        rows += model_range.rows(self.flexible_bodies) + exact_range.rows(self.exact_beams)
        rows += _error_rows(self)
        rows += [("warning", text) for text in self.warnings] if warnings else []
        return rows


# --- verdict --------------------------------------------------------------------------------------


def _error_objections(error: ErrorEstimate, accuracy: float) -> list[str]:
    """Objections to a failed second run, and to units of q whose error exceeds `accuracy`."""
    objections = []
    if error.covered is not None:
        objections.append(
            f"the error is unknown after t = {error.covered:.4g} s, where the second run stopped; "
            "use a shorter run or other tolerances"
        )
    horizon = ""
    if error.divergence_time is not None:
        horizon = f" (predictable until {error.divergence_time:.4g} s)"
        horizon = " (not predictable from the start)" if error.diverges_at_start else horizon
    for unit, worst in error.difference("q").items():
        if worst > error_limit(error.excursion, unit, accuracy, accuracy):
            motion = f", with a motion of {error.excursion.get(unit, 0.0):.2g} {unit}"
            motion = "" if unit == "rad" else motion
            objections.append(
                f"the estimated error of q is {worst:.1e} {unit or '1'}{motion}{horizon}"
            )
    return objections


# --- rows -----------------------------------------------------------------------------------------


def _error_rows(c: Certificate) -> list[tuple[str, str]]:
    error = c.error
    rows = [] if c.achieved_error is None else [("error", str(c.achieved_error))]
    if error is None:
        scope_rows = [("scope of the error", c.error_scope)]
        missing = [("error", "not estimated (certify=True estimates it by a second run)")]
        return rows + scope_rows if rows else missing
    is_limited = error.divergence_time is not None and not error.diverges_at_start
    until = f" up to t = {error.divergence_time:.6g} s" if is_limited else ""
    covered_span = "over the whole run"
    if error.covered is not None:
        covered_span = f"up to t = {error.covered:.6g} s, unknown afterwards"
        until = until or f" {covered_span}"
    for kind in ("q", "u"):
        whole_run = (
            f"; {_format_errors(error.difference(kind))} {covered_span}" if is_limited else ""
        )
        values = _format_errors(error.largest(kind) if is_limited else error.difference(kind))
        if values:
            source = f" (from a second run, {error.reference})" if kind == "q" else ""
            rows.append((f"error of {kind}, at most", f"{values}{until}{whole_run}{source}"))
    rows.append(("scope of the error", c.error_scope))
    if error.divergence_time is not None:
        horizon = "the start: from the first sample on"
        horizon = f"t = {error.divergence_time:.6g} s: afterwards" if is_limited else horizon
        text = (
            f"{horizon} the two runs differ by more than {ANGLE:g} rad or {PART:.0%} of the "
            "motion, and error estimates are not valid"
        )
        rows.append(("predictable until", text))
    if error.tenfold_time is not None:
        rows.append(("growth of errors", f"tenfold every {error.tenfold_time:.3g} s"))
    return rows


def _format_errors(errors: dict[str, float]) -> str:
    return ", ".join(f"{value:.1e} {unit or '1'}" for unit, value in errors.items())
