"""Prescribed motion: a drive and its exact first and second time derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from ..errors import ExpressionError
from ..ir import OPERATIONS
from ..ir.graph import Graph, Node
from ..ir.tangent import derivative
from .expression import Expression, Name
from .inputs import Inputs, Resolved

#: Longest numerator or denominator of a constant; fractions are stored as decimal text.
_MAX_BITS = 12_000


def motion(
    drive: Expression, time: Node, resolve: Callable[[Name], Node] | None = None
) -> tuple[Node, Node, Node]:
    """Position, speed and acceleration of a drive as nodes of the graph of `time`.

    The drive depends on `t` and on what `resolve` gives, functions of `time` too.  Derivatives are
    exact on every smooth piece.  Raises ExpressionError where their constants cannot be stored.
    """
    position = drive.build(time.graph, (lambda _: time) if resolve is None else resolve)
    speed = derivative(position, {time: 1})
    acceleration = derivative(speed, {time: 1})
    for node in (position, speed, acceleration):
        _refuse_long_constants(node, drive)
    return position, speed, acceleration


def _refuse_long_constants(root: Node, drive: Expression) -> None:
    """Derivatives multiply constants exactly; hundreds of them make numbers nobody can store."""
    seen: set[int] = set()
    stack = [root]
    while stack:
        node = stack.pop()
        if node.number in seen:
            continue
        seen.add(node.number)
        stack.extend(node.args)
        exact = node.value
        if exact is None:
            continue
        if max(exact.numerator.bit_length(), exact.denominator.bit_length()) > _MAX_BITS:
            raise ExpressionError(
                f"the derivatives of {drive.text[:60]!r} hold a constant of thousands of digits; "
                "write the product of its constants as one number"
            )
        try:
            float(exact)
        except OverflowError:
            raise ExpressionError(
                f"the derivatives of {drive.text[:60]!r} hold a constant beyond 1.8e308; scale it"
            ) from None


def motion_at(
    drive: Expression, t: float, inputs: Inputs | None = None
) -> tuple[float, float, float]:
    """(position, speed, acceleration) of a drive at time t in double precision; `inputs` are those
    that it may name.

    An entry is nan or infinite where the mathematics has no finite value.
    """
    resolved = Resolved(Graph().element("t"), inputs or {})
    nodes = motion(drive, resolved.time, resolved.node)
    q, u, a = (value(node, resolved.leaf(t)) for node in nodes)
    return q, u, a


#: A drive may jump by no more than this share of its own size, in position and in speed.
_CONTINUOUS = 1e-6


def jump(
    drive: Expression, gaps: Iterable[tuple[float, float]], inputs: Inputs | None = None
) -> str:
    """What jumps first across gaps (before, after) in time, in s; "" if nothing does.

    A position that jumps is no motion, a speed that jumps needs an impulse, and neither has a
    finite effort.
    """
    resolved = Resolved(Graph().element("t"), inputs or {})
    nodes = motion(drive, resolved.time, resolved.node)[:2]
    for gap in gaps:
        for what, node in zip(("position", "speed"), nodes, strict=True):
            a, b = (value(node, resolved.leaf(t)) for t in gap)
            if abs(b - a) > _CONTINUOUS * max(1.0, abs(a), abs(b)):
                return (
                    f"jumps in {what} at t = {gap[0]:g} s, from {a:g} to {b:g}; "
                    "join the pieces so that position and speed are continuous"
                )
    return ""


def value(node: Node, leaf: Callable[[Node], float]) -> float:
    """Double-precision value of a node; `leaf` gives the value of each input entry.

    nan where the mathematics has no value; only the chosen branch of a `select` counts.
    """
    known: dict[int, float] = {}
    stack = [node]
    while stack:
        current = stack[-1]
        if current.number in known:
            stack.pop()
            continue
        missing = [a for a in current.args if a.number not in known]
        if missing:
            stack.extend(missing)
            continue
        known[current.number] = _one(current, [known[a.number] for a in current.args], leaf)
    return known[node.number]


def _one(node: Node, args: list[float], leaf: Callable[[Node], float]) -> float:
    if node.op == "pi":
        return math.pi
    if node.op == "element":
        return leaf(node)
    if node.value is None:
        return float(OPERATIONS[node.op].value(*args))
    try:
        return float(node.value)
    except OverflowError:
        return math.inf
