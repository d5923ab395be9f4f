"""Pairs of sines and cosines of one argument, and the level at which they can be computed.

Sine and cosine of one argument cost little more than either; four arguments in a vector cost about
as much as one.  Arguments are sorted by the number of sines that they depend on in sequence: those
that need none (coordinates, times, sums of them) are computed first and together.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from mstmm.ir import Assign, Guard, Operand, Statement, Store, Temporary

from .statement_units import operands


@dataclass
class Angle:
    """One argument, and the temporaries of its sine and cosine."""

    argument: Operand
    sines: list[int] = field(default_factory=list)
    cosines: list[int] = field(default_factory=list)


@dataclass
class Level:
    """Statements that need the angles of earlier levels, then the angles of this level."""

    statements: list[Assign] = field(default_factory=list)
    angles: list[Angle] = field(default_factory=list)


@dataclass(frozen=True)
class SincosLevels:
    """Statements of a kernel with its angles extracted: levels first, then the rest."""

    levels: tuple[Level, ...]
    remaining: tuple[Assign | Store | Guard, ...]

    def defined_temporaries(self) -> list[int]:
        """Temporaries that the levels define."""
        numbers = []
        for level in self.levels:
            numbers += [statement.number for statement in level.statements]
            numbers += [n for angle in level.angles for n in (*angle.sines, *angle.cosines)]
        return numbers


def gather(statements: Sequence[Statement]) -> SincosLevels:
    """Extract sines and cosines from straight-line code, each as early as its argument allows.

    Statements that no argument needs keep their order and follow the last level.
    """
    depth: dict[int, int] = {}
    angles: dict[Operand, Angle] = {}
    needed: dict[int, Assign] = {}
    for statement in statements:
        if not isinstance(statement, Assign):
            continue
        needed[statement.number] = statement
        level = max((_depth(a, depth) for a in statement.args), default=0)
        if statement.op not in ("sin", "cos"):
            depth[statement.number] = level
            continue
        depth[statement.number] = level + 1
        angle = angles.setdefault(statement.args[0], Angle(statement.args[0]))
        (angle.sines if statement.op == "sin" else angle.cosines).append(statement.number)
    levels = [Level() for _ in range(max(depth.values(), default=0))]
    for argument, angle in angles.items():
        levels[_depth(argument, depth)].angles.append(angle)
    return _fill_levels(levels, statements, needed)


def _depth(operand: Operand, depth: dict[int, int]) -> int:
    return depth[operand.number] if isinstance(operand, Temporary) else 0


def _fill_levels(
    levels: Sequence[Level], statements: Sequence[Statement], assigns: dict[int, Assign]
) -> SincosLevels:
    """Move the statements that the levels' arguments need in front of them."""
    position_of = {number: position for position, number in enumerate(assigns)}
    done: set[int] = {
        number
        for level in levels
        for angle in level.angles
        for number in (*angle.sines, *angle.cosines)
    }
    for level in levels:
        missing = _missing_temporaries((angle.argument for angle in level.angles), assigns, done)
        level.statements = [
            assigns[number] for number in sorted(missing, key=position_of.__getitem__)
        ]
        done |= missing
    rest = tuple(
        s
        for s in statements
        if isinstance(s, (Store, Guard)) or (isinstance(s, Assign) and s.number not in done)
    )
    return SincosLevels(tuple(levels), rest)


def _missing_temporaries(
    roots: Iterable[Operand], assigns: dict[int, Assign], done: set[int]
) -> set[int]:
    """Temporaries that `roots` depend on and that are not yet computed."""
    missing: set[int] = set()
    stack = list(roots)
    while stack:
        operand = stack.pop()
        if isinstance(operand, Temporary) and operand.number not in missing | done:
            missing.add(operand.number)
            stack.extend(operands(assigns[operand.number]))
    return missing
