"""Which sines and cosines of a kernel belong together, and where they can be computed.

Sine and cosine of one argument cost little more than either; four arguments in a vector cost about
what one costs.  Arguments are sorted by how many other sines stand in the way of knowing them:
those that need none (coordinates, times, sums of them) are computed first of all, together.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from mstmm.ir import Assign, Guard, Operand, Statement, Store, Temporary

from .statement_units import operands


@dataclass
class Angle:
    """One argument, and the temporaries that are its sine and its cosine."""

    argument: Operand
    sines: list[int] = field(default_factory=list)
    cosines: list[int] = field(default_factory=list)


@dataclass
class Level:
    """Statements that need the angles of earlier levels, then this level's own angles."""

    statements: list[Assign] = field(default_factory=list)
    angles: list[Angle] = field(default_factory=list)


@dataclass(frozen=True)
class SincosLevels:
    """A kernel's statements with its angles taken out: levels first, then everything else."""

    levels: tuple[Level, ...]
    rest: tuple[Assign | Store | Guard, ...]

    def made(self) -> list[int]:
        """Temporaries of the levels."""
        found = []
        for level in self.levels:
            found += [statement.number for statement in level.statements]
            found += [n for angle in level.angles for n in (*angle.sines, *angle.cosines)]
        return found


def gather(statements: Sequence[Statement]) -> SincosLevels:
    """Take the sines and cosines out of a straight line, each as early as its argument allows.

    What no argument needs keeps its order and stands behind the last level.
    """
    depth: dict[int, int] = {}
    angles: dict[Operand, Angle] = {}
    needed: dict[int, Assign] = {}
    for statement in statements:
        if not isinstance(statement, Assign):
            continue
        needed[statement.number] = statement
        below = max((_depth(a, depth) for a in statement.args), default=0)
        if statement.op not in ("sin", "cos"):
            depth[statement.number] = below
            continue
        depth[statement.number] = below + 1
        angle = angles.setdefault(statement.args[0], Angle(statement.args[0]))
        (angle.sines if statement.op == "sin" else angle.cosines).append(statement.number)
    levels = [Level() for _ in range(max(depth.values(), default=0))]
    for argument, angle in angles.items():
        levels[_depth(argument, depth)].angles.append(angle)
    return _placed(levels, statements, needed)


def _depth(operand: Operand, depth: dict[int, int]) -> int:
    return depth[operand.number] if isinstance(operand, Temporary) else 0


def _placed(
    levels: Sequence[Level], statements: Sequence[Statement], assigns: dict[int, Assign]
) -> SincosLevels:
    """Move what the levels' arguments are made of in front of them."""
    place = {number: position for position, number in enumerate(assigns)}
    done: set[int] = {
        number
        for level in levels
        for angle in level.angles
        for number in (*angle.sines, *angle.cosines)
    }
    for level in levels:
        wanted = _closure((angle.argument for angle in level.angles), assigns, done)
        level.statements = [assigns[number] for number in sorted(wanted, key=place.__getitem__)]
        done |= wanted
    rest = tuple(
        s
        for s in statements
        if isinstance(s, (Store, Guard)) or (isinstance(s, Assign) and s.number not in done)
    )
    return SincosLevels(tuple(levels), rest)


def _closure(roots: Iterable[Operand], assigns: dict[int, Assign], done: set[int]) -> set[int]:
    """Temporaries behind `roots` that are not computed yet."""
    found: set[int] = set()
    stack = list(roots)
    while stack:
        operand = stack.pop()
        if isinstance(operand, Temporary) and operand.number not in found | done:
            found.add(operand.number)
            stack.extend(operands(assigns[operand.number]))
    return found
