"""Prescribed motion: a drive and its exact first and second time derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable

from .expression import Expression
from .expression_parser import MEANING
from .graph import Graph, Node, derivative

_MEANING: dict[str, Callable[..., float]] = MEANING | {
    "select": MEANING["where"],
    "floor": lambda a: float(math.floor(a)),
    "eq": lambda a, b: float(a == b),
    "and": lambda a, b: float(a != 0 and b != 0),
    "or": lambda a, b: float(a != 0 or b != 0),
    "not": lambda a: float(a == 0),
}


def motion(drive: Expression, time: Node) -> tuple[Node, Node, Node]:
    """Position, speed and acceleration of a drive as nodes of the graph of `time`.

    The drive may depend on `t` alone.  Derivatives are exact on every smooth piece.
    """
    position = drive.build(time.graph, lambda _: time)
    speed = derivative(position, {time: 1})
    return position, speed, derivative(speed, {time: 1})


def motion_at(drive: Expression, t: float) -> tuple[float, float, float]:
    """(position, speed, acceleration) of a drive at time t in double precision.

    An entry is nan or infinite where the mathematics has no finite value.
    """
    time = Graph().element("t")
    nodes = motion(drive, time)
    q, u, a = (value(node, lambda _: t) for node in nodes)
    return q, u, a


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
    try:
        return float(node.value) if node.value is not None else float(_MEANING[node.op](*args))
    except ZeroDivisionError:
        return math.nan if args[0] == 0 else math.inf
    except OverflowError:
        return math.inf
    except ValueError:
        return math.nan
