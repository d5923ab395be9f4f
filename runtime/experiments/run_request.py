"""What a run is asked for: accuracy by tolerances or by a target error, and its execution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mstmm.argument_validation import abbreviate, require_bool, require_texts
from mstmm.array_validation import finite_float
from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import SceneError

from ..integrate.methods import Method
from ..integrate.settings import Settings
from ..integrate.steppers import AUTO, get
from ..run import classical_run, external_integrators

#: Errors below this cannot be distinguished from rounding.
MIN_ERROR = 1e-12


@dataclass(frozen=True)
class ErrorRequest:
    """Target error of a run.

    Attributes:
        error: rad, and relative to the largest excursion for other coordinates; for one quantity in
            `of` in its unit, for several relative to the excursion of each.
        of: names of quantities; empty for all coordinates.
    """

    error: float
    of: str | Sequence[str] = ()


@dataclass(frozen=True)
class Execution:
    """How `simulate` carries out a run; it does not change the numbers.

    Attributes:
        on_risk: action on objections to the result (`Result.risks`): "warn", in the result;
            "refuse", which raises RiskRefused, before the run if they are known by then, else after
            it with the result; "ignore", which leaves `warnings` empty.
        progress: called with (t, t_end) about every 0.1 s.  An exception that it raises ends the
            run and is raised by `simulate`; a checkpoint is written before.
        checkpoint: file with the state of the run, written every 30 s, on interruption, and at the
            end, until the result is saved.
        resume: continue from that file, if it exists, bit for bit.
    """

    on_risk: str = "warn"
    progress: Callable[[float, float], None] | None = None
    checkpoint: str | Path | None = None
    resume: bool = False


@dataclass(frozen=True)
class GivenAccuracy:
    """Method and accuracy as given by the user; None where not given."""

    method: Method | None
    step: float | None
    rtol: float | None
    atol: float | None

    @property
    def method_name(self) -> str | None:
        """Name of the method; None if it is left open."""
        return None if self.method is None else self.method.name or None

    def settings(
        self, t_end: float, t_start: float, output_times: tuple[float, ...] | None
    ) -> Settings:
        """Settings of a run, with defaults where not given."""
        return Settings(
            t_end, t_start, self.method_name or (AUTO if self.step is None else METHOD), self.step,
            RTOL if self.rtol is None else self.rtol, ATOL if self.atol is None else self.atol,
            output_times, **({} if self.method is None else self.method.options),
        )  # fmt: skip


def check_execution(given: Execution | None) -> Execution:
    """Checked execution, the default for None.  SceneError for other types."""
    run = Execution() if given is None else given
    if not isinstance(run, Execution):
        raise SceneError(f"execution = {abbreviate(run)}: expected an mstmm.Execution")
    if run.progress is not None and not callable(run.progress):
        raise SceneError(
            f"progress = {abbreviate(run.progress)}: expected a function of (t, t_end)"
        )
    require_bool("resume", run.resume)
    return run


def parse_error_request(
    error: float | ErrorRequest | None, given: GivenAccuracy, kept: bool
) -> ErrorRequest | None:
    """Checked request for a target error, with a tuple of names; None without one.

    `kept` means with a checkpoint, or resumed.  Raises SceneError for an error that cannot be
    reached, and together with settings of the steps.
    """
    if error is None:
        return None
    request = error if isinstance(error, ErrorRequest) else ErrorRequest(error)
    names = require_texts("of", request.of, "rod1.angle")
    value = finite_float("error", request.error, "an error above zero, such as 1e-6")
    if not value > 0:
        raise SceneError(f"error = {value:g}: expected an error above zero, such as 1e-6")
    if value >= 1 and len(names) != 1:
        raise SceneError(
            f"error = {value:g}: expected less than 1, in rad, and relative to the excursion of "
            "other coordinates; name one quantity, "
            "ErrorRequest(error, of=...), for an error in its unit"
        )
    if value < MIN_ERROR:
        raise SceneError(
            f"error = {value:g}: expected {MIN_ERROR:g} or more, because rounding to 16 digits "
            "causes larger errors"
        )
    _check_settings(given, kept)
    return ErrorRequest(value, names)


def _check_settings(given: GivenAccuracy, kept: bool) -> None:
    """Raise SceneError for settings that are not allowed together with an error."""
    for name in ("rtol", "atol", "step"):
        value = getattr(given, name)
        if value is not None:
            raise SceneError(
                f"{name} = {value!r} together with error: the error determines tolerances and "
                "steps; give only one of the two"
            )
    if kept:
        raise SceneError(
            "error needs several runs, which have no checkpoint: leave out checkpoint and resume, "
            "or use the method and the tolerances that a run with error has found"
        )
    method = given.method_name
    if method is None or method == AUTO or method in external_integrators.METHODS:
        return
    if method in classical_run.METHODS or not get(method).adaptive:
        raise SceneError(
            f"method {method!r} together with error: it has fixed steps, without a tolerance; "
            "leave out method, or give one with adaptive steps"
        )
