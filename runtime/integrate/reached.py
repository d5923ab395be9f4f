"""What a run that was asked for an error reached, and which runs that took."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from mstmm.risk import Risk


@dataclass(frozen=True)
class Attempt:
    """One run on the way.

    Attributes:
        method: as in `simulate`.
        rtol, atol: its tolerances.
        apart: how far it is from the last run, which is about its error; None for the last one, and
            for a run that did not reach the end.
        evaluations: calls of the right-hand side, and of the residual by implicit methods.
        cpu_s: processor time, s.
        failure: why it is no use, "" if it is.
    """

    method: str
    rtol: float
    atol: float
    apart: float | None
    evaluations: int
    cpu_s: float
    failure: str = ""


@dataclass(frozen=True)
class ReachedError:
    """The error of a run that was asked for one.

    Attributes:
        asked: largest error wanted.
        estimate: largest error expected over the samples; None where nothing is known of it.
        of, unit, scaling: what it is an error of, as in a chart; unit "1" for parts.
        method, rtol, atol: of the run that was kept.
        found: how the estimate was made.
        why: what kept the run from what was asked, "" if nothing did.
        runs: all runs that it took, in their order.
    """

    asked: float
    estimate: float | None
    of: str
    unit: str
    scaling: str
    method: str
    rtol: float
    atol: float
    found: str
    why: str
    runs: tuple[Attempt, ...]

    @property
    def met(self) -> bool:
        """True where the estimate is at most what was asked."""
        return self.estimate is not None and self.estimate <= self.asked

    @property
    def cpu_s(self) -> float:
        """Processor time of all runs, s."""
        return sum(run.cpu_s for run in self.runs)

    @property
    def risk(self) -> Risk | None:
        """That what was asked is not met, and why; None where it is."""
        if self.met:
            return None
        reached = "not known" if self.estimate is None else f"{_with(self.estimate, self.unit)}"
        return Risk(
            "wanted-error", self.of,
            f"the error of {self.of} asked for, {_with(self.asked, self.unit)}, is not reached: "
            f"the estimate is {reached}, because {self.why}", self._remedy, self.estimate,
            self.asked, self.unit,
        )  # fmt: skip

    @property
    def _remedy(self) -> str:
        shorter = "simulate a shorter time"
        if self.estimate is None:
            return shorter
        return f"ask for {_with(self.estimate, self.unit)} or more, or {shorter}"

    @property
    def warning(self) -> str:
        """The same as a sentence; "" where it is met."""
        return "" if self.risk is None else str(self.risk)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for files."""
        return asdict(self) | {"met": self.met, "cpu_s": self.cpu_s}

    def __str__(self) -> str:
        if self.estimate is None:
            return f"not known, {_with(self.asked, self.unit)} asked for"
        return (
            f"{_with(self.estimate, self.unit)} of {self.of} ({_with(self.asked, self.unit)} asked "
            f"for): {self.found}"
        )


def _with(value: float, unit: str) -> str:
    return f"{value:.1e}" if unit == "1" else f"{value:.1e} {unit}"


def from_dict(data: Mapping[str, Any] | None) -> ReachedError | None:
    """What `to_dict` gave.  TypeError or KeyError where that is something else."""
    if data is None:
        return None
    numbers = [data[key] for key in ("asked", "rtol", "atol")]
    for row in (rows := list(data["runs"])):
        numbers += [row[key] for key in ("rtol", "atol", "evaluations", "cpu_s")]
        numbers += [] if row["apart"] is None else [row["apart"]]
    numbers += [] if data["estimate"] is None else [data["estimate"]]
    if not all(isinstance(x, (int, float)) for x in numbers):
        raise TypeError("an error that was reached holds something that is no number")
    runs = tuple(Attempt(**row) for row in rows)
    kept = {key: value for key, value in data.items() if key not in ("met", "cpu_s", "runs")}
    return ReachedError(**kept, runs=runs)
