"""Achieved error of a run with a target error, and the runs that were needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mstmm.plain_data import from_plain, stored_as, to_plain
from mstmm.risk import Risk


@dataclass(frozen=True)
class ErrorControlRun:
    """Run that was made to achieve a target error.

    Attributes:
        method: as in `simulate`.
        rtol, atol: its tolerances.
        distance: distance from the last run, which is about its error; None for the last run, and
            for a run that did not reach the end.
        evaluations: calls of the right-hand side, and of the residual by implicit methods.
        cpu_s: processor time, s.
        failure: reason that its result cannot be used, or "".
    """

    method: str
    rtol: float
    atol: float
    distance: float | None = field(metadata=stored_as("apart"))
    evaluations: int
    cpu_s: float
    failure: str = ""


@dataclass(frozen=True)
class AchievedError:
    """Achieved error of a run with a target error.

    Attributes:
        target: target error.
        estimate: largest expected error over the samples; None if unknown.
        quantity, unit, scaling: quantities of the error, its unit ("1" if relative) and its
            scaling, as in a chart.
        method, rtol, atol: of the run whose result is used.
        how: method of the estimate.
        reason: reason that the target was not met, or "".
        runs: all runs that were made, in order.
    """

    target: float = field(metadata=stored_as("asked"))
    estimate: float | None
    quantity: str = field(metadata=stored_as("of"))
    unit: str
    scaling: str
    method: str
    rtol: float
    atol: float
    how: str = field(metadata=stored_as("found"))
    reason: str = field(metadata=stored_as("why"))
    runs: tuple[ErrorControlRun, ...]

    @property
    def is_met(self) -> bool:
        """True if the estimate is at most the target error."""
        return self.estimate is not None and self.estimate <= self.target

    @property
    def cpu_s(self) -> float:
        """Processor time of all runs, s."""
        return sum(run.cpu_s for run in self.runs)

    @property
    def risk(self) -> Risk | None:
        """Finding that the target error is not met, with the reason; None if it is met."""
        if self.is_met:
            return None
        estimate_text = (
            "not known" if self.estimate is None else f"{_with_unit(self.estimate, self.unit)}"
        )
        return Risk(
            "wanted-error", self.quantity,
            f"the target error of {self.quantity}, {_with_unit(self.target, self.unit)}, is not "
            f"reached: "
            f"the estimate is {estimate_text}, because {self.reason}", self._remedy, self.estimate,
            self.target, self.unit,
        )  # fmt: skip

    @property
    def _remedy(self) -> str:
        shorter_run = "simulate a shorter time"
        if self.estimate is None:
            return shorter_run
        return f"request {_with_unit(self.estimate, self.unit)} or more, or {shorter_run}"

    @property
    def warning(self) -> str:
        """That finding as a sentence; "" if the target is met."""
        return "" if self.risk is None else str(self.risk)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for files."""
        return to_plain(self) | {"met": self.is_met, "cpu_s": self.cpu_s}

    def __str__(self) -> str:
        if self.estimate is None:
            return f"not known, {_with_unit(self.target, self.unit)} requested"
        return (
            f"{_with_unit(self.estimate, self.unit)} of {self.quantity} "
            f"({_with_unit(self.target, self.unit)} requested): {self.how}"
        )


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.1e}" if unit == "1" else f"{value:.1e} {unit}"


def from_dict(data: Mapping[str, Any] | None) -> AchievedError | None:
    """Read the data that `to_dict` writes.  TypeError or KeyError for anything else."""
    if data is None:
        return None
    numbers = [data[key] for key in ("asked", "rtol", "atol")]
    for run_data in (rows := list(data["runs"])):
        numbers += [run_data[key] for key in ("rtol", "atol", "evaluations", "cpu_s")]
        numbers += [] if run_data["apart"] is None else [run_data["apart"]]
    numbers += [] if data["estimate"] is None else [data["estimate"]]
    if not all(isinstance(number, (int, float)) for number in numbers):
        raise TypeError("the record of an achieved error contains a value that is no number")
    runs = tuple(from_plain(ErrorControlRun, run_data) for run_data in rows)
    attributes = {key: value for key, value in data.items() if key not in ("met", "cpu_s", "runs")}
    return from_plain(AchievedError, attributes | {"runs": runs})
