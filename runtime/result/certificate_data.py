"""Data of a certificate: measures of a run, each with its limits and what it means."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mstmm.plain_data import stored_as
from mstmm.risk import Risk

from ..run.error_estimate import ANGLE

#: Default limit of the relative drift of energy or momentum of a trusted run.
DEFAULT_DRIFT = 1e-5

#: Default limit of the error: rad of an angle, relative to the motion of other coordinates.
DEFAULT_ACCURACY = ANGLE

#: Drift above which energy and momentum are not conserved, for any settings: the error of the
#: motion is then about `DEFAULT_ACCURACY`.
MAX_DRIFT = DEFAULT_ACCURACY / 20

#: Drift that control of local errors leaves, in tolerances.
_DRIFT_PER_TOLERANCE = 10.0

#: Recommended settings are to leave this part of the bound.
_SAFETY_FACTOR = 0.2

#: Drifts decrease by less than the order of a method while steps are long: by this part of it, and
#: at most by the second value.
_ORDER_REDUCTION, _MAX_DRIFT_ORDER = 0.75, 4.0

#: Tolerances below this are rounding.
_MIN_TOLERANCE = 1e-13

#: Pivot loss and singularity measure that are reported as risks.
MAX_PIVOT_LOSS, MIN_SINGULAR_MEASURE = 1e8, 1e-4
#: Pivot loss up to which refined accelerations keep their digits.
MAX_REFINED_LOSS = 1e13

#: Scenes of more bodies are not checked for pivots: the check would take longer than the run.
MAX_CHECKED_BODIES = 200_000

#: Singularity measure below which a change of angles within a fixed step (rad) is a risk, and the
#: limit of this change.
NEAR_SINGULAR_MEASURE, MAX_STEP_ANGLE = 0.1, 0.3


# --- balances -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Drift:
    """Largest change of a conserved quantity, with its reference scale."""

    name: str
    unit: str
    largest: float
    scale: float
    of_what: str

    @property
    def relative(self) -> float:
        """Relative drift largest / scale; 0 if both vanish; nan if the quantity is not finite."""
        if not self.is_known:
            return np.nan
        if self.scale > 0:
            return self.largest / self.scale
        return np.inf if self.largest > 0 else 0.0

    @property
    def is_known(self) -> bool:
        """Whether the drift is known: no overflow, and at least one sample has a value."""
        return bool(np.isfinite(self.largest) and np.isfinite(self.scale))

    @property
    def risk_name(self) -> str:
        """Name of the risk that the quantity is not conserved."""
        return "energy-drift" if self.unit == "J" else "momentum-drift"

    def __str__(self) -> str:
        if not self.is_known:
            return f"not determined: no sample has a finite value in {self.unit}"
        text = f"{self.largest:.1e} {self.unit} of {self.scale:.3g} {self.unit} {self.of_what}"
        return f"{text} ({self.relative:.1e})"


@dataclass(frozen=True)
class StepControl:
    """Fixed steps of a method of an order, tolerances, or a target error.

    Control of local errors lets energy drift by up to nine times the tolerance, and errors of
    motions are four to sixty times the drift, relative to what moves; both counted on the runs of
    benchmarks/risk_checks.

    Attributes:
        step: s; None for adaptive steps.
        rtol, atol: its tolerances.
        order: of the method.
        target_error: target error of the whole run, relative or in rad; 0 if in other units, None
            without a target.
    """

    step: float | None
    rtol: float
    atol: float
    order: int
    target_error: float | None = None

    @property
    def bound(self) -> float:
        """Largest relative drift of energy and momentum that counts as conserved."""
        if self.target_error is not None:
            return max(DEFAULT_DRIFT, self.target_error)
        if self.step is not None:
            return MAX_DRIFT
        tolerance = max(self.rtol, self.atol)
        return min(max(DEFAULT_DRIFT, _DRIFT_PER_TOLERANCE * tolerance), MAX_DRIFT)

    def finer(self, drift: float) -> str:
        """Advice on step or tolerances for a relative drift that is too large."""
        if self.step is not None:
            order = min(_ORDER_REDUCTION * self.order, _MAX_DRIFT_ORDER)
            shorter = self.step * (_SAFETY_FACTOR * self.bound / drift) ** (1 / order)
            return f"use a step below {shorter:.2g} s, or an adaptive method"
        drift_ratio = drift / max(self.rtol, self.atol)
        is_expected = (
            drift_ratio <= _SAFETY_FACTOR * _DRIFT_PER_TOLERANCE and self.target_error is None
        )
        reduction = _SAFETY_FACTOR * (MAX_DRIFT if is_expected else DEFAULT_DRIFT) / drift
        if self.target_error:
            return f"request an error below {reduction * self.target_error:.1g}"
        if reduction * self.rtol < _MIN_TOLERANCE:
            return "check efforts, loads and drives for jumps and for unbounded values"
        return (
            f"use rtol = {reduction * self.rtol:.1g} and atol = {reduction * self.atol:.1g}, "
            f"or less"
        )


@dataclass(frozen=True)
class SpringDeflection:
    """Largest deflection of the stiffest spring of a scene.

    Attributes:
        spring: in words, 'spring "loop"' or 'hinge "mount"'.
        stiffness: N/m.
        largest: m, over the samples.
    """

    spring: str
    stiffness: float
    largest: float


# --- conditioning ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class PivotLoss:
    """Largest ratio of rounding (in units of 1e-16) to pivot in a run.

    With its hinge, its time (s), and the number of refinements of the accelerations.
    """

    ratio: float
    hinge: str
    time: float
    is_refined: int = field(default=0, metadata=stored_as("refines"))

    @property
    def error(self) -> float:
        """Relative error of the accelerations; each refinement multiplies it by the initial one."""
        return min(1e-16 * self.ratio, 1.0) ** (1 + self.is_refined)

    @property
    def sweep(self) -> str:
        """Name of the sweep that avoids this loss of digits."""
        return "qr" if self.is_refined or self.ratio > MAX_REFINED_LOSS else "refined"

    @property
    def risk(self) -> Risk | None:
        """Finding that digits are lost; None for a loss up to `MAX_PIVOT_LOSS`."""
        if not self.error > 1e-16 * MAX_PIVOT_LOSS:
            return None
        refined = f" after {self.is_refined} refinements" if self.is_refined else ""
        return Risk(
            "pivot-loss", f'hinge "{self.hinge}"',
            f'hinge "{self.hinge}": mass ratio {self.ratio:.0e}, heavy body outboard of light '
            f"ones: relative error of accelerations up to {self.error:.0e}{refined}",
            f'use sweep = "{self.sweep}" (explicit methods); or, if the root is free, make the '
            "heavy body the first one", self.ratio, MAX_PIVOT_LOSS,
        )  # fmt: skip


@dataclass(frozen=True)
class SingularDistance:
    """Smallest singularity measure of a hinge, and its rotation within a fixed step.

    The coordinates fail where the measure vanishes (gimbal: |cos|). The rotation is in rad, 0 for
    adaptive steps.
    """

    measure: float
    hinge: str
    time: float
    rotation_per_step: float = field(default=0.0, metadata=stored_as("turned"))

    @property
    def risk(self) -> Risk | None:
        """Finding on a coordinate singularity or on fixed steps too long near one; else None."""
        approach = (
            f'hinge "{self.hinge}" comes within {self.measure:.0e} of the singularity of its '
            f"coordinates, at about t = {self.time:.4g} s"
        )
        if self.measure < MIN_SINGULAR_MEASURE:
            return Risk(
                "gimbal", f'hinge "{self.hinge}"', approach, "use a ball hinge", self.measure,
                MIN_SINGULAR_MEASURE,
            )  # fmt: skip
        if self.measure < NEAR_SINGULAR_MEASURE and self.rotation_per_step > MAX_STEP_ANGLE:
            return Risk(
                "gimbal", f'hinge "{self.hinge}"',
                f"{approach}, where its angles change by {self.rotation_per_step:.2g} rad per step",
                "use a ball hinge, or an adaptive method",
                self.rotation_per_step, MAX_STEP_ANGLE, "rad",
            )  # fmt: skip
        return None


# --- closed loops ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Closure:
    """Largest position gap (m, rad) and velocity error (m/s, rad/s) of the loops of a run.

    Over the checked samples. Also describes the number of independent rows, the redundant rows, and
    the components of indeterminate reactions. Steps `position_level` leave velocity errors of the
    size of their errors. `misfit` is the largest gap (m, rad) of a redundant row if it exceeds
    rounding, else 0, and `misfit_loop` is the name of its loop.
    """

    gap: float
    slip: float
    summary: str = field(default="", metadata=stored_as("counted"))
    redundant_text: str = field(default="", metadata=stored_as("repeated"))
    open_loads: str = ""
    position_level: bool = field(default=False, metadata=stored_as("on_positions"))
    misfit: float = 0.0
    misfit_loop: str = ""

    def __str__(self) -> str:
        text = f"position gap {self.gap:.1e} (m, rad), velocity error {self.slip:.1e} (m/s, rad/s)"
        text += ", not removed by position-level steps" if self.position_level else ""
        notes = (
            ("", self.summary), ("redundant rows: ", self.redundant_text),
            ("indeterminate loads: ", self.open_loads),
        )  # fmt: skip
        return "; ".join((text, *(title + words for title, words in notes if words)))
