"""Prescribed motion: a drive and its exact first and second derivatives by time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from ..errors import ExpressionError
from ..ir import OPERATIONS
from ..ir.differentiation import derivative
from ..ir.graph import Graph, Node
from .expression import Expression, Name
from .inputs import InputNodes, Inputs

#: Most bits of a numerator or denominator: fractions are stored as decimal text.
_MAX_CONSTANT_BITS = 12_000


def motion(
    drive: Expression, time: Node, resolve: Callable[[Name], Node] | None = None
) -> tuple[Node, Node, Node]:
    """Position, speed and acceleration of a drive as nodes of the graph of `time`.

    The drive depends on `t` and on the nodes that `resolve` returns for names; these are functions
    of `time` too.  Derivatives are exact on every smooth piece.  Raises ExpressionError where a
    constant of a derivative is too long or too large.
    """
    position = drive.build(time.graph, (lambda _: time) if resolve is None else resolve)
    speed = derivative(position, {time: 1})
    acceleration = derivative(speed, {time: 1})
    for node in (position, speed, acceleration):
        _check_constants(node, drive)
    return position, speed, acceleration


def _check_constants(root: Node, drive: Expression) -> None:
    """Reject constants that exact differentiation has made too long or too large.

    Derivatives multiply constants exactly, so that hundreds of factors give very long fractions.
    """
    visited: set[int] = set()
    stack = [root]
    while stack:
        node = stack.pop()
        if node.number in visited:
            continue
        visited.add(node.number)
        stack.extend(node.args)
        exact = node.value
        if exact is None:
            continue
        if max(exact.numerator.bit_length(), exact.denominator.bit_length()) > _MAX_CONSTANT_BITS:
            raise ExpressionError(
                f"the derivatives of {drive.text[:60]!r} contain a constant of thousands of "
                "digits; write the product of its constants as one number"
            )
        try:
            float(exact)
        except OverflowError:
            raise ExpressionError(
                f"the derivatives of {drive.text[:60]!r} contain a constant above 1.8e308; scale "
                "the drive"
            ) from None


def motion_at(
    drive: Expression, t: float, inputs: Inputs | None = None
) -> tuple[float, float, float]:
    """Position, speed and acceleration of a drive at time t (s), in double precision.

    `inputs` are the inputs and signals that the drive may name.  An entry is nan or infinite where
    the expression has no finite value.
    """
    resolved = InputNodes(Graph().element("t"), inputs or {})
    nodes = motion(drive, resolved.time, resolved.node)
    q, u, a = (node_value(node, resolved.input_value(t)) for node in nodes)
    return q, u, a


#: Largest jump of a drive in position or speed that counts as rounding, relative above 1.
_MAX_RELATIVE_JUMP = 1e-6


def jump_message(
    drive: Expression, gaps: Iterable[tuple[float, float]], inputs: Inputs | None = None
) -> str:
    """Message about the first jump of a drive across gaps (before, after) in time (s), or "".

    A jump in position is not a motion, and a jump in speed needs an impulse: neither has a finite
    effort.
    """
    resolved = InputNodes(Graph().element("t"), inputs or {})
    nodes = motion(drive, resolved.time, resolved.node)[:2]
    for gap in gaps:
        for quantity, node in zip(("position", "speed"), nodes, strict=True):
            a, b = (node_value(node, resolved.input_value(t)) for t in gap)
            if abs(b - a) > _MAX_RELATIVE_JUMP * max(1.0, abs(a), abs(b)):
                return (
                    f"jumps in {quantity} at t = {gap[0]:g} s, from {a:g} to {b:g}; "
                    "join the pieces so that position and speed are continuous"
                )
    return ""


def node_value(node: Node, leaf: Callable[[Node], float]) -> float:
    """Value of a node in double precision; `leaf` returns the value of each input entry.

    nan where the expression has no value; only the selected branch of a `select` counts.
    """
    values: dict[int, float] = {}
    stack = [node]
    while stack:
        current = stack[-1]
        if current.number in values:
            stack.pop()
            continue
        missing_args = [a for a in current.args if a.number not in values]
        if missing_args:
            stack.extend(missing_args)
            continue
        values[current.number] = _operation_value(
            current, [values[a.number] for a in current.args], leaf
        )
    return values[node.number]


def _operation_value(node: Node, args: list[float], leaf: Callable[[Node], float]) -> float:
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
