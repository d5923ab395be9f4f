"""Derivatives of expressions by time (prescribed motion) and by names, as in compiled code.

Inputs and signals in expressions are polynomials in time with coefficients read at run time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from ..errors import ExpressionError
from ..ir import OPERATIONS
from ..ir.differentiation import derivative
from ..ir.graph import Graph
from ..ir.terms import Node, dependencies
from ..numerics.piecewise_polynomial import NUMBERS_PER_PIECE, PiecewisePolynomial
from .expression import Expression, Name

#: Inputs and signals by their names.
Inputs = Mapping[str, PiecewisePolynomial]

#: Port of the coefficients of all inputs, COUNT of each.
INPUTS = "inputs"


def polynomial(numbers: Sequence[Node], time: Node) -> Node:
    """Value at `time` of a piece (`mstmm.numerics.piecewise_polynomial`) whose coefficients are
    nodes."""
    t0, c0, c1, c2, c3 = numbers
    s = time - t0
    return c0 + s * (c1 + s * (c2 + s * c3))


def input_node(place: int, time: Node) -> Node:
    """Value at `time` of the input at index `place`, its coefficients read from the port."""
    return polynomial(_coefficients(place, time), time)


def _coefficients(place: int, time: Node) -> list[Node]:
    first_index = NUMBERS_PER_PIECE * place
    return [time.graph.element(INPUTS, first_index + k) for k in range(NUMBERS_PER_PIECE)]


class InputNodes:
    """Nodes of inputs, and the values of their leaves at a given time."""

    def __init__(self, time: Node, inputs: Inputs) -> None:
        self.time, self.inputs = time, inputs
        self._leaves: dict[int, tuple[str, int]] = {}
        self._indices = {name: index for index, name in enumerate(inputs)}

    def node(self, name: Name) -> Node:
        """Build the node of `t` or of an input."""
        if name.text == "t":
            return self.time
        numbers = _coefficients(self._indices[name.text], self.time)
        self._leaves.update({node.number: (name.text, k) for k, node in enumerate(numbers)})
        return polynomial(numbers, self.time)

    def input_value(self, t: float) -> Callable[[Node], float]:
        """Function that returns the value of each leaf at time t (s)."""

        def number(node: Node) -> float:
            if node.number not in self._leaves:
                return t
            name, k = self._leaves[node.number]
            return self.inputs[name].piece_at(t)[k]

        return number


# --- prescribed motion ----------------------------------------------------------------------------


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
    _check_constants((position, speed, acceleration), drive)
    return position, speed, acceleration


def _check_constants(motion: tuple[Node, ...], drive: Expression) -> None:
    """Reject constants that exact differentiation has made too long or too large.

    Derivatives multiply constants exactly, so that hundreds of factors give very long fractions.
    """
    for node in dependencies(*motion):
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
    for term in dependencies(node):
        values[term.number] = _operation_value(term, [values[a.number] for a in term.args], leaf)
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


# --- derivatives by names -------------------------------------------------------------------------


def _leaves_and_root(expression: Expression) -> tuple[dict[Name, Node], Node]:
    """Nodes of the names in an expression, and of the expression, in a graph of its own."""
    graph = Graph()
    leaves = {name: graph.element("names", i) for i, name in enumerate(expression.names)}
    return leaves, expression.build(graph, leaves.__getitem__)


def _derivative_by(leaf: Node, root: Node, leaves: Mapping[Name, Node]) -> Node:
    return derivative(root, {**dict.fromkeys(leaves.values(), 0), leaf: 1})


def expression_derivatives(
    expression: Expression, values: Callable[[Name], float]
) -> dict[Name, float]:
    """Derivatives by each name in double precision, in the order of the text.

    nan or infinity where there is no finite derivative.
    """
    leaves, root = _leaves_and_root(expression)
    numbers = {leaf.number: float(values(name)) for name, leaf in leaves.items()}
    return {
        name: node_value(_derivative_by(leaf, root, leaves), lambda node: numbers[node.number])
        for name, leaf in leaves.items()
    }


def dependency_parts(
    expression: Expression, names: Sequence[Name]
) -> tuple[list[tuple[Name, ...] | None], bool]:
    """Structure of an expression in `names`: dependence of its derivatives, and a remainder.

    Returns for each of `names` the names on which the derivative by it depends, None where that
    derivative is zero everywhere; and whether the expression is nonzero where all of them are zero.
    """
    leaves, root = _leaves_and_root(expression)
    name_dependencies: list[tuple[Name, ...] | None] = []
    for name in names:
        slope = _derivative_by(leaves[name], root, leaves)
        used = dependencies(slope)
        name_dependencies.append(
            None if slope.value == 0 else tuple(n for n, leaf in leaves.items() if leaf in used)
        )
    zeroed = {
        name: root.graph.constant(0) if name in names else leaf for name, leaf in leaves.items()
    }
    return name_dependencies, expression.build(root.graph, zeroed.__getitem__).value != 0
