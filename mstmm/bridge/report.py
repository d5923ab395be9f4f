"""Report of a cross-check: errors of kernels and statements of mechanics, as table or data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

#: Largest relative difference between the equations and the IR, both at 50 digits.
EQUATIONS = 1e-30


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
        exact = self.equations is None or self.equations <= EQUATIONS
        rounded = self.compiled is None or self.compiled <= 1.0
        return exact and rounded and not self.problems and self.stopped < self.points


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
class Report:
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
        found = [f"{s.name}: error {s.error:.1e} above {s.limit:.0e}" for s in self.statements
                 if not s.passed]  # fmt: skip
        for kernel in self.kernels:
            found += [f"{kernel.kernel}: {problem}" for problem in kernel.problems]
            if not (kernel.passed or kernel.problems):
                found.append(f"{kernel.kernel}: {_errors(kernel)}, worst at {kernel.worst_point!r}")
        return found

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
            said = f"{k.points} points" + (f", {k.stopped} stopped by a guard" if k.stopped else "")
            lines.append(f"  {k.kernel:12} {_errors(k)}; {said}")
        width = max((len(s.name) for s in self.statements), default=0)
        lines += [
            f"  {s.name:{width}}  {s.error:.1e} (allowed {s.limit:.0e})" for s in self.statements
        ]
        lines += [f"  problem: {text}" for text in self.problems]
        return "\n".join([*lines, *(f"  note: {text}" for text in self.remarks)])


def _errors(kernel: KernelCheck) -> str:
    parts = []
    if kernel.equations is not None:
        parts.append(f"equations - IR {kernel.equations:.1e}")
    if kernel.compiled is not None:
        by = "interpreter" if kernel.interpreted else "C"
        parts.append(f"{by} {kernel.compiled:.2f} of its rounding bound")
    return ", ".join(parts) or "not compared"
