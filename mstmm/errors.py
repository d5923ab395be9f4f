"""Exceptions of the package: one base class, few subclasses, one exit code each.

A message names file, element and key, what was expected (with units), what was found, and a remedy.
The command line prints only the message and exits with `exit_code`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


class MstmmError(Exception):
    """Base class of the package's exceptions; `exit_code` is that of the command line."""

    exit_code = 2


class SceneError(MstmmError):
    """Invalid scene (file or Python object) or argument; the message names file and key."""


class LoopClosureError(SceneError):
    """Loop that cannot be closed.

    `gap` is the largest position gap of a constraint row (m, rad or the unit of a coupling).
    `pose` has the coordinates of the nearest pose, of hinges and shapes by name.
    """

    def __init__(
        self, message: str = "", gap: float = 0.0, pose: Mapping[str, Sequence[float]] | None = None
    ) -> None:
        super().__init__(message)
        self.gap, self.pose = gap, dict(pose or {})


class ExpressionError(MstmmError):
    """Text that is no valid expression (grammar: `mstmm.expression.expression`)."""


class ElementError(MstmmError):
    """Contradictory definition of a hinge, body or force; the message names the equation."""


class EnvironmentFailure(MstmmError):
    """Missing part of the environment: a compiler, an optional package, a writable folder."""

    exit_code = 3


class NumericalFailure(MstmmError):
    """Computation without a reliable answer; the message names time, element and cause."""

    exit_code = 4


class UndeterminedMotionError(NumericalFailure):
    """Undetermined acceleration of a hinge: the bodies it carries have no inertia there.

    `place` is the index of the hinge's body in the tree, -1 if unknown.
    """

    def __init__(self, message: str = "", place: int = -1) -> None:
        super().__init__(message)
        self.place = place


class RiskRefused(NumericalFailure):
    """Run rejected because of its risks (`Execution(on_risk="refuse")`).

    `risks` are the objections (`mstmm.risk.Risk`); `result` is the result that was computed, None
    if they were found before the run.
    """

    def __init__(self, message: str = "", risks: Sequence[Any] = (), result: Any = None) -> None:
        super().__init__(message)
        self.risks, self.result = tuple(risks), result


class Interrupted(MstmmError):
    """Interrupt (Ctrl-C, SIGTERM) with a message, for instance how to continue the run."""

    exit_code = 130
