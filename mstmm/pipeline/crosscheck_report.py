"""Report of a cross-check: errors of kernels and statements of mechanics, as table or data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

#: Largest relative difference between the equations and the IR, both at 50 digits.
MAX_EQUATION_ERROR = 1e-30


@dataclass(frozen=True)
class KernelCheck:
    """Result for one kernel: largest errors over its points.

    `equations`: relative error of the IR against the stated equations at 50 digits; None if the
    definition is not available.  `compiled`: error of the C relative to its rounding bound, or of
    the engine's interpreter for a kernel without C (`interpreted`); None if not compiled.
    `stopped` counts points at which a guard stopped every form of the kernel.
    """

    kernel: str
    points: int
    stopped: int
    equations: float | None
    compiled: float | None
    worst_point: str
    problems: tuple[str, ...] = ()
    interpreted: bool = False

    @property
    def passed(self) -> bool:
        matches_equations = self.equations is None or self.equations <= MAX_EQUATION_ERROR
        is_within_rounding = self.compiled is None or self.compiled <= 1.0
        return (
            matches_equations
            and is_within_rounding
            and not self.problems
            and self.stopped < self.points
        )


@dataclass(frozen=True)
class Statement:
    """Statement of mechanics about an element, with its largest error and the limit."""

    name: str
    error: float
    limit: float

    @property
    def passed(self) -> bool:
        return self.error <= self.limit


@dataclass(frozen=True)
class CrossCheckReport:
    """Cross-check of one element.  `str(report)` is a table."""

    kind: str
    name: str
    kernels: tuple[KernelCheck, ...]
    statements: tuple[Statement, ...]
    remarks: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        return all(k.passed for k in self.kernels) and all(s.passed for s in self.statements)

    @property
    def problems(self) -> list[str]:
        """List of failures, one line each; empty if all checks passed."""
        lines = [f"{s.name}: error {s.error:.1e} above {s.limit:.0e}" for s in self.statements
                 if not s.passed]  # fmt: skip
        for kernel in self.kernels:
            lines += [f"{kernel.kernel}: {problem}" for problem in kernel.problems]
            if not (kernel.passed or kernel.problems):
                lines.append(
                    f"{kernel.kernel}: {_error_text(kernel)}, worst at {kernel.worst_point!r}"
                )
        return lines

    def to_json(self) -> dict[str, Any]:
        """Convert the report to plain data."""
        return {
            "kind": self.kind, "name": self.name, "passed": self.passed,
            "kernels": [{**vars(k), "problems": list(k.problems), "passed": k.passed}
                        for k in self.kernels],
            "statements": [{**vars(s), "passed": s.passed} for s in self.statements],
            "remarks": list(self.remarks), "problems": self.problems,
        }  # fmt: skip

    def __str__(self) -> str:
        lines = [f"{self.kind} {self.name}: {'agrees' if self.passed else 'DOES NOT AGREE'}"]
        for k in self.kernels:
            counts = f"{k.points} points" + (
                f", {k.stopped} stopped by a guard" if k.stopped else ""
            )
            lines.append(f"  {k.kernel:12} {_error_text(k)}; {counts}")
        width = max((len(s.name) for s in self.statements), default=0)
        lines += [
            f"  {s.name:{width}}  {s.error:.1e} (allowed {s.limit:.0e})" for s in self.statements
        ]
        lines += [f"  problem: {text}" for text in self.problems]
        return "\n".join([*lines, *(f"  note: {text}" for text in self.remarks)])


def _error_text(kernel: KernelCheck) -> str:
    parts = []
    if kernel.equations is not None:
        parts.append(f"equations - IR {kernel.equations:.1e}")
    if kernel.compiled is not None:
        executor = "interpreter" if kernel.interpreted else "C"
        parts.append(f"{executor} {kernel.compiled:.2f} of its rounding bound")
    return ", ".join(parts) or "not compared"
