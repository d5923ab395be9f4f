"""Data classes of a chart: settings, measured points, skipped runs, model levels, reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

#: Absolute tolerance as a fraction of the relative one.
ATOL_FRACTION = 0.01


@dataclass(frozen=True)
class Setting:
    """Method, model level and accuracy setting of a run.

    `value` is the fixed step in s if `fixed`, else the relative tolerance.
    """

    method: str
    model: str
    value: float
    fixed: bool = False

    @property
    def options(self) -> dict[str, Any]:
        """Keyword arguments of `simulate`."""
        if self.fixed:
            return {"method": self.method, "step": self.value}
        return {"method": self.method, "rtol": self.value, "atol": ATOL_FRACTION * self.value}

    @property
    def numbers(self) -> dict[str, float]:
        """Numerical options: {"step": s}, or {"rtol": ..., "atol": ...}."""
        return {name: value for name, value in self.options.items() if name != "method"}

    def __str__(self) -> str:
        return f"step {self.value:.3g} s" if self.fixed else f"rtol {self.value:.0e}"


@dataclass(frozen=True)
class Point:
    """Point of a chart: error and CPU time of one setting.

    Attributes:
        setting: method, model level and tolerance or step.
        error: largest deviation from the reference over the samples; None for a run that failed.
        cpu_s: CPU time of the whole call of `simulate`, the smallest of `repeats` calls; s.
        evaluations, factorizations, steps: counts of the run, None if the method does not count.
        failure: reason why the run gave no error, "" if it did.
        reference_limited: the error is small enough to be the error of the reference.
        error_bound: error bound: largest error of this setting and all tighter ones of its curve,
            so that an accidentally small error does not count.
        warnings: warnings of this run.
        is_too_coarse: the fixed step is too long for the fastest motion; such a run is not trusted
            and never recommended, however small its error.
    """

    setting: Setting
    error: float | None = None
    cpu_s: float | None = None
    repeats: int = 0
    evaluations: int | None = None
    factorizations: int | None = None
    steps: int | None = None
    failure: str = ""
    reference_limited: bool = False
    error_bound: float | None = None
    warnings: tuple[str, ...] = ()
    is_too_coarse: bool = False

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.setting.method

    @property
    def model(self) -> str:
        """Name of the model level."""
        return self.setting.model

    @property
    def curve(self) -> tuple[str, str]:
        """(model level, method): key of the points that differ only in tolerance or step."""
        return self.setting.model, self.setting.method

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in chart.json."""
        return {
            "method": self.method, "model": self.model, "setting": self.setting.numbers,
            "error": self.error, "sure_error": self.error_bound, "cpu_s": self.cpu_s,
            "repeats": self.repeats, "evaluations": self.evaluations,
            "factorizations": self.factorizations, "steps": self.steps,
            "limited_by_reference": self.reference_limited, "failure": self.failure or None,
            "warnings": list(self.warnings), "too_coarse": self.is_too_coarse,
        }  # fmt: skip


@dataclass(frozen=True)
class Skipped:
    """Method, model level or tighter settings of a curve that were not run, with the reason.

    `is_unsupported`: the scene or the machine does not support it; otherwise time was short, or it
    would have shown nothing new.
    """

    method: str
    model: str
    setting: str
    reason: str
    is_unsupported: bool

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in chart.json."""
        return {
            "method": self.method or None, "model": self.model or None,
            "setting": self.setting or None, "reason": self.reason, "refused": self.is_unsupported,
        }  # fmt: skip

    def __str__(self) -> str:
        name = ", ".join(part for part in (self.model, self.method, self.setting) if part)
        return f"{name}: {self.reason}"


@dataclass(frozen=True)
class Level:
    """Model level: name, error (None if unknown), degrees of freedom, and engine."""

    name: str
    error: float | None
    degrees_of_freedom: int
    engine: str

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in chart.json."""
        return {
            "name": self.name, "error": self.error,
            "degrees_of_freedom": self.degrees_of_freedom, "engine": self.engine,
        }  # fmt: skip


@dataclass(frozen=True)
class Reference:
    """Reference solution that errors are relative to.

    Attributes:
        error: error of the reference itself, in the same measure as all others.
        made_by: description of the runs that were compared.
        model: name of its model level.
        measure, unit, scaling: compared quantity, its unit, and what it is divided by.
        stop_event: event that ended its run, and when; "" if none did.
        is_static: no coordinate moves.
    """

    error: float
    made_by: str
    model: str
    measure: str
    unit: str
    scaling: str
    stop_event: str = ""
    is_static: bool = False

    @property
    def smallest_resolved_error(self) -> float:
        """Smallest resolved error: errors below it may be those of the reference."""
        return 3.0 * self.error

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in chart.json."""
        return {
            "error": self.error, "made_by": self.made_by, "model": self.model,
            "measure": self.measure, "unit": self.unit, "scaling": self.scaling,
            "ended": self.stop_event or None, "still": self.is_static,
        }  # fmt: skip
