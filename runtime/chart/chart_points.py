"""What a chart is made of: settings, runs with what they cost and how far they err, and what was
not run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

#: Absolute tolerance as part of the relative one.
ATOL_PART = 0.01


@dataclass(frozen=True)
class Setting:
    """How a run is made: `value` is the fixed step in s, or the relative tolerance."""

    method: str
    model: str
    value: float
    fixed: bool = False

    @property
    def options(self) -> dict[str, Any]:
        """Arguments of `simulate`."""
        if self.fixed:
            return {"method": self.method, "step": self.value}
        return {"method": self.method, "rtol": self.value, "atol": ATOL_PART * self.value}

    @property
    def numbers(self) -> dict[str, float]:
        """{"step": s}, or {"rtol": ..., "atol": ...}."""
        return {name: value for name, value in self.options.items() if name != "method"}

    def __str__(self) -> str:
        return f"step {self.value:.3g} s" if self.fixed else f"rtol {self.value:.0e}"


@dataclass(frozen=True)
class Point:
    """One run.

    Attributes:
        setting: how it was made.
        error: largest deviation from the reference over the samples; None for a run that failed.
        cpu_s: processor time of the whole call of `simulate`, the least of `repeats`; s.
        evaluations, factorizations, steps: counts of the run, None where the method keeps none.
        failure: why the run gave no error, "" if it did.
        limited: the error is so small that it may be the reference's own.
        sure_error: the largest error of this setting and all tighter ones of its curve, so that a
            lucky hit is not taken for accuracy.
        warnings: what the run itself warns of.
        too_coarse: among that, that its fixed step is longer than the fastest motion needs: such a
            run is not to be trusted however near it came, and never recommended.
    """

    setting: Setting
    error: float | None = None
    cpu_s: float | None = None
    repeats: int = 0
    evaluations: int | None = None
    factorizations: int | None = None
    steps: int | None = None
    failure: str = ""
    limited: bool = False
    sure_error: float | None = None
    warnings: tuple[str, ...] = ()
    too_coarse: bool = False

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.setting.method

    @property
    def model(self) -> str:
        """Name of the level of model."""
        return self.setting.model

    @property
    def curve(self) -> tuple[str, str]:
        """(model, method): the points that differ in tolerance or step alone."""
        return self.setting.model, self.setting.method

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "method": self.method, "model": self.model, "setting": self.setting.numbers,
            "error": self.error, "sure_error": self.sure_error, "cpu_s": self.cpu_s,
            "repeats": self.repeats, "evaluations": self.evaluations,
            "factorizations": self.factorizations, "steps": self.steps,
            "limited_by_reference": self.limited, "failure": self.failure or None,
            "warnings": list(self.warnings), "too_coarse": self.too_coarse,
        }  # fmt: skip


@dataclass(frozen=True)
class Skipped:
    """What was not run, and why: a method, a level of model, or the tighter settings of a curve.

    `refused` tells what the scene or the machine does not allow from what time did not allow.
    """

    method: str
    model: str
    setting: str
    reason: str
    refused: bool

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "method": self.method or None, "model": self.model or None,
            "setting": self.setting or None, "reason": self.reason, "refused": self.refused,
        }  # fmt: skip

    def __str__(self) -> str:
        named = ", ".join(word for word in (self.model, self.method, self.setting) if word)
        return f"{named}: {self.reason}"


@dataclass(frozen=True)
class Level:
    """A level of model: its name, its own error (None where it was not found), degrees of freedom,
    and the engine that ran it."""

    name: str
    error: float | None
    degrees_of_freedom: int
    engine: str

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "name": self.name, "error": self.error,
            "degrees_of_freedom": self.degrees_of_freedom, "engine": self.engine,
        }  # fmt: skip


@dataclass(frozen=True)
class Reference:
    """What errors are measured against.

    Attributes:
        error: of the reference itself, in the measure of all others.
        made_by: the runs that were compared, in words.
        model: its level of model.
        measure, unit, scaling: what is compared, in which unit, and what it is divided by.
        ended: which event ended its run, and when; "" where none did.
        still: nothing moves in it.
    """

    error: float
    made_by: str
    model: str
    measure: str
    unit: str
    scaling: str
    ended: str = ""
    still: bool = False

    @property
    def floor(self) -> float:
        """Errors below this may be the reference's own."""
        return 3.0 * self.error

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "error": self.error, "made_by": self.made_by, "model": self.model,
            "measure": self.measure, "unit": self.unit, "scaling": self.scaling,
            "ended": self.ended or None, "still": self.still,
        }  # fmt: skip
