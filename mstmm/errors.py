"""Every error a user can meet: one base class, few subclasses, one exit code each.

A message says which file, which element and which key, what was expected (with units), what was
found, and one way out.  The command line prints the message alone and exits with `exit_code`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


class MstmmError(Exception):
    """Base of every error raised on purpose; `exit_code` is what the command line returns."""

    exit_code = 2


class SceneError(MstmmError):
    """A scene (file or Python object) that does not describe a system; names file and key."""


class OpenLoop(SceneError):
    """A loop that cannot close; `gap` is what the row that misses most lacks (m, rad or the unit of
    a coupling), `pose` the coordinates of the nearest pose, of hinges and shapes by their names."""

    def __init__(
        self, message: str = "", gap: float = 0.0, pose: Mapping[str, Sequence[float]] | None = None
    ) -> None:
        super().__init__(message)
        self.gap, self.pose = gap, dict(pose or {})


class ExpressionError(MstmmError):
    """Text that is not an expression of the small grammar (`mstmm.expression.expression`)."""


class ElementError(MstmmError):
    """A hinge, body or force definition that contradicts itself; names the equation."""


class EnvironmentFailure(MstmmError):
    """Something the machine lacks: a compiler, an optional package, a writable folder."""

    exit_code = 3


class NumericalFailure(MstmmError):
    """A computation that has no trustworthy answer; names time, element and cause."""

    exit_code = 4


class UndeterminedMotion(NumericalFailure):
    """A hinge whose acceleration nothing determines: what it carries has no inertia there.

    `place` is that of the hinge's body in the tree, -1 where it is not known.
    """

    def __init__(self, message: str = "", place: int = -1) -> None:
        super().__init__(message)
        self.place = place


class RiskRefused(NumericalFailure):
    """A run whose risks were not to be taken (`on_risk="refuse"`).

    `risks` are the rows that speak against it (`mstmm.risk.Risk`); `result` is what was computed,
    None where they were seen before the run.
    """

    def __init__(self, message: str = "", risks: Sequence[Any] = (), result: Any = None) -> None:
        super().__init__(message)
        self.risks, self.result = tuple(risks), result


class Interrupted(MstmmError):
    """An interrupt (Ctrl-C, SIGTERM) after which there is more to say than that it came."""

    exit_code = 130
