"""Target error of `simulate(error=...)`, and the settings allowed with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mstmm.argument_validation import require_texts
from mstmm.array_validation import finite_float
from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import SceneError

from ...integrate.steppers import AUTO, get
from ...run import classical_run, external_integrators

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
class Control:
    """Method and accuracy as given by the user; None where not given."""

    method: str | None
    step: float | None
    rtol: float | None
    atol: float | None

    def with_defaults(self) -> tuple[str, float, float]:
        """Method, relative and absolute tolerance, with defaults where not given."""
        default_method = AUTO if self.step is None else METHOD
        return (
            default_method if self.method is None else self.method,
            RTOL if self.rtol is None else self.rtol,
            ATOL if self.atol is None else self.atol,
        )


def parse_error_request(
    error: float | ErrorRequest | None, given: Control, kept: bool
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


def _check_settings(given: Control, kept: bool) -> None:
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
    method = given.method
    if method is None or method == AUTO or method in external_integrators.METHODS:
        return
    if method in classical_run.METHODS or not get(method).adaptive:
        raise SceneError(
            f"method {method!r} together with error: it has fixed steps, without a tolerance; "
            "leave out method, or give one with adaptive steps"
        )
