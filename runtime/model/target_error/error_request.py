"""What `simulate(error=...)` may be asked for, and together with what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mstmm.argument_validation import require_texts
from mstmm.array_validation import finite_float
from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import SceneError

from ...integrate.steppers import AUTO, get
from ...run import classical_run, external_integrators

#: Errors below this cannot be told from rounding.
LEAST = 1e-12


@dataclass(frozen=True)
class ErrorRequest:
    """A wanted error, of named quantities or, with none, of all coordinates."""

    error: float
    of: tuple[str, ...] = ()


@dataclass(frozen=True)
class Control:
    """What a user said of method and accuracy; None where nothing was said."""

    method: str | None
    step: float | None
    rtol: float | None
    atol: float | None

    def filled(self) -> tuple[str, float, float]:
        """Method, relative and absolute tolerance, with the defaults where nothing was said."""
        usual = AUTO if self.step is None else METHOD
        return (
            usual if self.method is None else self.method,
            RTOL if self.rtol is None else self.rtol,
            ATOL if self.atol is None else self.atol,
        )


def parse_error_request(
    error: float | None, of: str | Sequence[str], given: Control, kept: bool
) -> ErrorRequest | None:
    """What was asked for; None for no error.  `kept`: with a checkpoint, or resumed.

    Raises SceneError for an error that nobody can reach, and beside what would fix the steps.
    """
    names = require_texts("error_of", of, "rod1.angle")
    if error is None:
        if names:
            raise SceneError(f"error_of = {names[0]!r} says what an error is of; give error too")
        return None
    value = finite_float("error", error, "an error above zero, such as 1e-6")
    if not value > 0:
        raise SceneError(f"error = {value:g}: expected an error above zero, such as 1e-6")
    if value >= 1 and len(names) != 1:
        raise SceneError(
            f"error = {value:g}: expected less than 1: it is in rad, and in parts of how far other "
            "coordinates go; name one quantity (error_of) for an error in its unit"
        )
    if value < LEAST:
        raise SceneError(
            f"error = {value:g}: rounding of numbers of 16 digits leaves more; expected {LEAST:g} "
            "or above"
        )
    _alone(given, kept)
    return ErrorRequest(value, names)


def _alone(given: Control, kept: bool) -> None:
    """SceneError for what cannot stand beside an error."""
    for name in ("rtol", "atol", "step"):
        value = getattr(given, name)
        if value is not None:
            raise SceneError(
                f"{name} = {value!r} beside error: the error decides on tolerances and steps; "
                "leave one of the two out"
            )
    if kept:
        raise SceneError(
            "error takes several runs, of which no checkpoint is kept: leave checkpoint and resume "
            "out, or run with the method and the tolerances that a run with error has found"
        )
    method = given.method
    if method is None or method == AUTO or method in external_integrators.METHODS:
        return
    if method in classical_run.METHODS or not get(method).adaptive:
        raise SceneError(
            f"method {method!r} beside error: it takes fixed steps, which no tolerance bounds; "
            "leave method out, or name one that chooses its steps"
        )
