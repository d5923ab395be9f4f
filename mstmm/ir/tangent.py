"""Exact derivatives of graphs and kernels by forward differentiation of every operation.

`derivative` works on the nodes of one graph; `tangent` turns a kernel into one that computes its
outputs and their derivative along a given direction.  Value numbering shares what value and
derivative have in common, and a derivative that is zero whatever the numbers costs nothing.

Kinks are taken branch by branch: abs, min, max and select give the slope of the branch that is
taken; sign, floor, comparisons and logic are flat.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import product
from typing import Any

from .graph import Graph
from .kernel import KernelIR
from .statements import LOOPS, Assign, Element, Guard, Inner, Operand, Port, Solve, Sum, Temporary
from .terms import Node, Number, Terms

#: Name of the derivative of a port.
PREFIX = "d_"

Rule = Callable[[Terms, Node, list[Node]], Node]


def derivative(node: Node, seeds: Mapping[Node, Node | Number]) -> Node:
    """Exact directional derivative: `seeds` gives the derivative of each independent leaf."""
    return derivatives([node], seeds)[0]


def derivatives(nodes: Sequence[Node], seeds: Mapping[Node, Node | Number]) -> list[Node]:
    """Exact directional derivatives of several nodes of one graph, common parts once."""
    known = {leaf.number: leaf.graph.node(d) for leaf, d in seeds.items()}
    for node in nodes:
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
            slopes = [known[a.number] for a in current.args]
            known[current.number] = _differentiated(current, slopes)
    return [known[node.number] for node in nodes]


def _differentiated(node: Node, d: list[Node]) -> Node:
    """Derivative of one operation given the derivatives of its operands."""
    graph = node.graph
    if node.op not in _RULES or all(slope.value == 0 for slope in d):
        return graph.constant(0)
    return _RULES[node.op](graph, node, d)


def _power(graph: Terms, node: Node, d: list[Node]) -> Node:
    base, exponent = node.args
    slope = exponent * graph.power(base, exponent - 1) * d[0]
    if d[1].value == 0:
        return slope
    # Where the exponent stands still, a negative base has a slope but no logarithm.
    still = graph.call("eq", d[1], 0)
    return graph.select(still, slope, slope + node * graph.call("log", base) * d[1])


def _arc(graph: Terms, node: Node, d: list[Node]) -> Node:
    """Derivative of asin; that of acos is its opposite."""
    a = node.args[0]
    return d[0] / graph.sqrt(1 - a * a)


def _angle(graph: Terms, node: Node, d: list[Node]) -> Node:
    y, x = node.args
    return (d[0] * x - y * d[1]) / (y * y + x * x)


def _lesser(graph: Terms, node: Node, d: list[Node]) -> Node:
    """Slope of the operand that `min` gives."""
    return graph.select(graph.call("lt", *node.args), d[0], d[1])


def _greater(graph: Terms, node: Node, d: list[Node]) -> Node:
    return graph.select(graph.call("lt", *node.args), d[1], d[0])


#: Operation -> its derivative; an operation without a rule is flat.
_RULES: dict[str, Rule] = {
    "neg": lambda g, y, d: -d[0],
    "add": lambda g, y, d: d[0] + d[1],
    "sub": lambda g, y, d: d[0] - d[1],
    "mul": lambda g, y, d: d[0] * y.args[1] + y.args[0] * d[1],
    "div": lambda g, y, d: (d[0] - y * d[1]) / y.args[1],
    "pow": _power,
    "sqrt": lambda g, y, d: d[0] / (2 * y),
    "sin": lambda g, y, d: g.cos(y.args[0]) * d[0],
    "cos": lambda g, y, d: -(g.sin(y.args[0]) * d[0]),
    "tan": lambda g, y, d: (1 + y * y) * d[0],
    "asin": _arc,
    "acos": lambda g, y, d: -_arc(g, y, d),
    "atan": lambda g, y, d: d[0] / (1 + y.args[0] * y.args[0]),
    "atan2": _angle,
    "sinh": lambda g, y, d: g.call("cosh", y.args[0]) * d[0],
    "cosh": lambda g, y, d: g.call("sinh", y.args[0]) * d[0],
    "tanh": lambda g, y, d: (1 - y * y) * d[0],
    "exp": lambda g, y, d: y * d[0],
    "log": lambda g, y, d: d[0] / y.args[0],
    "abs": lambda g, y, d: g.call("sign", y.args[0]) * d[0],
    "min": _lesser,
    "max": _greater,
    "select": lambda g, y, d: g.select(y.args[0], d[1], d[2]),
    "sum": lambda g, y, d: g.sum_over_modes(d[0], str(y.leaf)),
}


def tangent(
    kernel: KernelIR,
    ports: Iterable[str],
    outputs: Iterable[str] | None = None,
    values: bool = True,
    guards: bool = True,
) -> KernelIR:
    """The kernel that computes `kernel`'s outputs y(x) and d_y = (dy/dx) d_x.

    Behind the inputs of `kernel` stands one `d_<port>` for each of `ports` (names of inputs, in
    the order of the kernel), of the same shape: the direction.  Behind its outputs stands one
    `d_<port>` for each of `outputs` (default: all), which accumulates where the output does.  With
    `values` False the outputs themselves are left out, with `guards` False the guards (for callers
    that run `kernel` as well), and what only they need.

    A run-time sized `solve` x = A^-1 b is differentiated as A^-1 db, by a second solve.

    Raises ValueError for names that the kernel does not have, for a kernel that reads what it has
    stored itself (differentiate it at a fixed size), and where A itself depends on `ports`: the
    right side db - dA x is then no array that a `solve` can read.
    """
    return _Tangent(kernel, set(ports), outputs, values, guards).run()


Index = tuple[int | str, ...]


class _Tangent:
    """One pass over a kernel: its statements replayed on a graph, then their derivatives."""

    def __init__(
        self,
        kernel: KernelIR,
        ports: set[str],
        outputs: Iterable[str] | None,
        values: bool,
        guards: bool,
    ) -> None:
        self.kernel, self.graph, self.guards = kernel, Graph(), guards
        names = [port.name for port in kernel.outputs]
        solved = {s.port for s in kernel.statements if isinstance(s, Solve)}
        wanted = (set(names) if outputs is None else set(outputs)) | solved
        for name in (ports - {port.name for port in kernel.inputs}) | (wanted - set(names)):
            raise ValueError(f"{kernel.name}: it has no port {name!r} to differentiate")
        self.directions = [port for port in kernel.inputs if port.name in ports]
        self.moving = {port.name: port for port in self.directions}
        self.wanted = [port for port in kernel.outputs if port.name in wanted]
        self.kept = [p for p in kernel.outputs if values or p.name in solved]
        self.nodes: dict[int, Node] = {}
        self.stores: dict[str, list[tuple[Index, Node]]] = {}
        self.still: list[Port] = []

    def run(self) -> KernelIR:
        self._replay()
        contents = {
            port.name: _nested(port.shape, dict(self.stores[port.name]))
            for port in self.kept
            if port.name in self.stores
        }
        stored = [(p, *entry) for p in self.wanted for entry in self.stores.get(p.name, [])]
        slopes = derivatives([node for _, _, node in stored], self._seeds())
        for port in self.wanted:
            found = zip(stored, slopes, strict=True)
            entries = {index: slope for (owner, index, _), slope in found if owner is port}
            if port in self.still:
                entries = dict.fromkeys(_places(port.shape), self.graph.constant(0))
            if entries:
                contents[PREFIX + port.name] = _nested(port.shape, entries)
        kernel = self.kernel
        return self.graph.kernel(
            f"{kernel.name}_tangent",
            (*kernel.inputs, *map(_slope, self.directions)),
            (*self.kept, *map(_slope, self.wanted)),
            contents,
            kernel.size_symbol,
            f"{kernel.name} and its derivative along a direction",
            kernel.sources,
        )

    def _replay(self) -> None:
        for statement in self.kernel.statements:
            if isinstance(statement, Assign):
                self._assign(statement)
            elif isinstance(statement, Guard):
                if not self.guards:
                    continue
                condition = self._value(statement.condition)
                self.graph.guard(condition, statement.code, statement.message)
            elif isinstance(statement, Solve):
                self._solve(statement)
            elif isinstance(statement, Sum):
                self._inner(statement)
            else:
                for inner in statement.body:
                    self._inner(inner)
                value = self._value(statement.value)
                self.stores.setdefault(statement.port, []).append((statement.index, value))

    def _inner(self, statement: Inner) -> None:
        if isinstance(statement, Assign):
            self._assign(statement)
            return
        for inner in statement.body:
            self._inner(inner)
        value = self._value(statement.value)
        self.nodes[statement.number] = self.graph.sum_over_modes(value, statement.over)

    def _assign(self, assign: Assign) -> None:
        operands = [self._value(operand) for operand in assign.args]
        self.nodes[assign.number] = self.graph.call(assign.op, *operands)

    def _value(self, operand: Operand) -> Node:
        if isinstance(operand, Temporary):
            return self.nodes[operand.number]
        if isinstance(operand, Element):
            self._refuse_stored(operand.port)
            return self.graph.element(operand.port, *operand.index)
        if operand.text == "pi":
            return self.graph.pi
        return self.graph.constant(Fraction(operand.text))

    def _refuse_stored(self, name: str) -> None:
        if name in self.stores:
            raise ValueError(
                f"{self.kernel.name}: it reads {name!r}, which it has stored; differentiate the "
                "kernel at a fixed size"
            )

    def _solve(self, solve: Solve) -> None:
        """The solve itself, and that of its derivative where it is not zero."""
        self._refuse_stored(solve.matrix)
        self._refuse_stored(solve.right)
        if solve.matrix in self.moving:
            raise ValueError(
                f"{self.kernel.name}: the matrix {solve.matrix!r} of a run-time sized solve "
                "depends on what is differentiated; differentiate the kernel at a fixed size"
            )
        self.graph.solve(solve.port, solve.matrix, solve.right, solve.code, solve.message)
        port = next(port for port in self.wanted if port.name == solve.port)
        if solve.right in self.moving:
            output, right = PREFIX + solve.port, PREFIX + solve.right
            self.graph.solve(output, solve.matrix, right, solve.code, solve.message)
            self.moving[port.name] = port
        else:
            self.still.append(port)

    def _seeds(self) -> dict[Node, Node | Number]:
        """The derivative of every entry that moves: an entry of `d_<port>`."""
        element = self.graph.element
        return {
            element(port.name, *index): element(PREFIX + port.name, *index)
            for port in self.moving.values()
            for index in _readings(port.shape)
        }


def _slope(port: Port) -> Port:
    return replace(port, name=PREFIX + port.name, meaning=f"derivative of {port.name}")


def _places(shape: Index) -> list[Index]:
    """Every index of the shape; along the run-time size a loop index stands for all."""
    letters = iter(LOOPS)
    ranges = [(next(letters),) if isinstance(extent, str) else range(extent) for extent in shape]
    return list(product(*ranges))


def _readings(shape: Index) -> list[Index]:
    """Every index by which a kernel may read an array: either letter along the run-time size."""
    ranges = [LOOPS if isinstance(extent, str) else range(extent) for extent in shape]
    return list(product(*ranges))


def _nested(shape: Index, entries: Mapping[Index, Node], at: Index = ()) -> Any:
    """Nested lists as `Graph.kernel` takes them; None where nothing is stored."""
    if not shape:
        return entries.get(at)
    if isinstance(shape[0], str):
        return _nested(shape[1:], entries, (*at, LOOPS[sum(isinstance(i, str) for i in at)]))
    return [_nested(shape[1:], entries, (*at, i)) for i in range(shape[0])]
