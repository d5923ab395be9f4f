"""Exact derivatives of graphs and kernels by forward differentiation of every operation.

`derivative` works on the nodes of one graph; `differentiate` converts a kernel into one that
computes its outputs and their derivative along a given direction.  Value numbering shares the
common terms of value and derivative, and a derivative that vanishes identically costs nothing.

At kinks the active branch counts: abs, min, max and select have the slope of that branch; the
slopes of sign, floor, comparisons and logic are zero.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

from .graph import Graph
from .interpreter import Interpreter
from .kernel import KernelIR
from .operations import OPERATIONS
from .statements import LOOPS, Constant, Element, Guard, Port, Solve, Store, Sum
from .terms import Node, Number

#: Prefix of the name of a port's derivative.
DERIVATIVE_PREFIX = "d_"


def derivative(node: Node, seeds: Mapping[Node, Node | Number]) -> Node:
    """Exact directional derivative of a node; `seeds` has the derivative of each free leaf."""
    return derivatives([node], seeds)[0]


def derivatives(nodes: Sequence[Node], seeds: Mapping[Node, Node | Number]) -> list[Node]:
    """Exact directional derivatives of several nodes of one graph, which share common terms."""
    results = {leaf.number: leaf.graph.node(d) for leaf, d in seeds.items()}
    for node in nodes:
        stack = [node]
        while stack:
            current = stack[-1]
            if current.number in results:
                stack.pop()
                continue
            missing = [a for a in current.args if a.number not in results]
            if missing:
                stack.extend(missing)
                continue
            slopes = [results[a.number] for a in current.args]
            results[current.number] = _apply_rule(current, slopes)
    return [results[node.number] for node in nodes]


def _apply_rule(node: Node, d: list[Node]) -> Node:
    """Derivative of an operation from those of its operands; zero if it has no rule."""
    graph = node.graph
    if all(slope.value == 0 for slope in d):
        return graph.constant(0)
    if node.op == "sum":
        return graph.sum_over_modes(d[0], str(node.leaf))
    slope = OPERATIONS[node.op].slope
    return graph.constant(0) if slope is None else slope(graph.call, node, node.args, d)


def differentiate(
    kernel: KernelIR,
    ports: Iterable[str],
    outputs: Iterable[str] | None = None,
    values: bool = True,
    guards: bool = True,
) -> KernelIR:
    """Differentiate a kernel: outputs y(x) and d_y = (dy/dx) d_x.

    The inputs of `kernel` are followed by a direction `d_<port>` of the same shape for each of
    `ports` (names of inputs, in the order of the kernel).  Its outputs are followed by a derivative
    `d_<port>` for each of `outputs` (default: all), which accumulates where the output does.  With
    `values` False the outputs of `kernel` are left out, with `guards` False the guards (for callers
    that run `kernel` as well), and terms that only they need.

    A run-time sized `solve` x = A^-1 b is differentiated as A^-1 db, by a second solve.  An output
    that the kernel reads again, and whose value is left out, becomes an input after those of
    `kernel`.

    Raises ValueError for names that the kernel does not have, for a `solve` of an array that the
    kernel has stored, and where A depends on `ports`: the right-hand side db - dA x is then no
    array that a `solve` can read.
    """
    return _KernelDifferentiation(kernel, set(ports), outputs, values, guards).run()


def jacobian(kernel: KernelIR, port: str, output: str) -> KernelIR:
    """Kernel that computes J = (d output / d port)^T, with one row per entry of `port`.

    The kernel must have a fixed size; `port` and `output` must be vectors.
    """
    return _JacobianBuilder(kernel, {port}, [output], values=False, guards=False).run()


Index = tuple[int | str, ...]


class _KernelDifferentiation(Interpreter):
    """Differentiation of one kernel: interpret it on a graph, keeping loops, then differentiate."""

    def __init__(
        self,
        kernel: KernelIR,
        ports: set[str],
        outputs: Iterable[str] | None,
        values: bool,
        guards: bool,
    ) -> None:
        self.graph, self.guards = Graph(), guards
        super().__init__(kernel, self.graph.operations, 0)
        names = [port.name for port in kernel.outputs]
        solved_names = {s.port for s in kernel.statements if isinstance(s, Solve)}
        differentiated_names = (set(names) if outputs is None else set(outputs)) | solved_names
        for name in (ports - {port.name for port in kernel.inputs}) | (
            differentiated_names - set(names)
        ):
            raise ValueError(f"{kernel.name}: no port {name!r} to differentiate")
        self.directions = [port for port in kernel.inputs if port.name in ports]
        self.varied_ports = {port.name: port for port in self.directions}
        self.differentiated_outputs = [
            port for port in kernel.outputs if port.name in differentiated_names
        ]
        self.kept_outputs = [p for p in kernel.outputs if values or p.name in solved_names]
        self.stores: dict[str, list[tuple[Index, Node]]] = {}
        self.reread_outputs: dict[str, Port] = {}
        self.constant_inputs: list[Port] = []

    def run(self) -> KernelIR:
        super().run()
        contents: dict[str, object] = {}
        for port in self.kept_outputs:
            if port.name in self.stores:
                self._store_output(contents, port, dict(self.stores[port.name]), port.name)
        reread = [
            port
            for name, port in self.reread_outputs.items()
            if port not in self.differentiated_outputs
        ]
        self.differentiated_outputs = [
            p for p in self.kernel.outputs if p in self.differentiated_outputs or p in reread
        ]
        stored = [
            (p, *entry)
            for p in self.differentiated_outputs
            for entry in self.stores.get(p.name, [])
        ]
        slopes = derivatives([node for _, _, node in stored], self._seeds())
        for port in self.differentiated_outputs:
            pairs = zip(stored, slopes, strict=True)
            entries = {index: slope for (owner, index, _), slope in pairs if owner is port}
            if port in self.constant_inputs:
                entries = dict.fromkeys(_indices(port.shape), self.graph.constant(0))
            if entries:
                self._store_output(contents, _derivative_port(port), entries, port.name)
        kernel = self.kernel
        reread_inputs = [
            port for port in self.reread_outputs.values() if port not in self.kept_outputs
        ]
        return self.graph.kernel(
            f"{kernel.name}_tangent",
            (*kernel.inputs, *reread_inputs, *map(_derivative_port, self.directions)),
            (*self.kept_outputs, *map(_derivative_port, self.differentiated_outputs)),
            contents,
            kernel.size_symbol,
            f"{kernel.name} and its derivative along a direction",
            kernel.sources,
        )

    def _store_output(
        self, contents: dict[str, object], port: Port, entries: Mapping[Index, Node], name: str
    ) -> None:
        """Store an output at the kernel's end, or at once where the kernel reads it again."""
        nested = _nest(port.shape, entries)
        if name in self.reread_outputs:
            self.graph.store(port, nested)
        else:
            contents[port.name] = nested

    def constant(self, constant: Constant) -> Node:
        return self.graph.number(constant)

    def entry(self, element: Element) -> Node:
        if element.port in self.stores:
            port = next(port for port in self.kernel.outputs if port.name == element.port)
            self.reread_outputs[port.name] = port
        return self.graph.element(element.port, *element.index)

    def total(self, statement: Sum) -> Node:
        return self.graph.sum_over_modes(self.inside(statement), statement.over)

    def store(self, store: Store) -> None:
        value = self.inside(store)
        self.stores.setdefault(store.port, []).append((store.index, value))

    def guard(self, guard: Guard) -> None:
        if self.guards:
            self.graph.guard(self.value(guard.condition), guard.code, guard.message)

    def _refuse_stored(self, name: str) -> None:
        if name in self.stores:
            raise ValueError(
                f"{self.kernel.name}: a solve reads {name!r}, which the kernel has stored; "
                "differentiate the kernel at a fixed size"
            )

    def solve(self, solve: Solve) -> None:
        """Request the solve, and that of its derivative unless the derivative is zero."""
        self._refuse_stored(solve.matrix)
        self._refuse_stored(solve.right)
        if solve.matrix in self.varied_ports:
            raise ValueError(
                f"{self.kernel.name}: the matrix {solve.matrix!r} of a run-time sized solve "
                "depends on differentiated inputs; differentiate the kernel at a fixed size"
            )
        options = solve.code, solve.message, solve.symmetric
        self.graph.solve(solve.port, solve.matrix, solve.right, *options)
        port = next(port for port in self.differentiated_outputs if port.name == solve.port)
        if solve.right in self.varied_ports:
            output, right = DERIVATIVE_PREFIX + solve.port, DERIVATIVE_PREFIX + solve.right
            self.graph.solve(output, solve.matrix, right, *options)
            self.varied_ports[port.name] = port
        else:
            self.constant_inputs.append(port)

    def _seeds(self) -> dict[Node, Node | Number]:
        """Derivative of every entry that varies: an entry of `d_<port>`."""
        element = self.graph.element
        return {
            element(port.name, *index): element(DERIVATIVE_PREFIX + port.name, *index)
            for port in (*self.varied_ports.values(), *self.reread_outputs.values())
            for index in _read_indices(port.shape)
        }


class _JacobianBuilder(_KernelDifferentiation):
    """Derivatives along every entry of one port, as rows of a matrix."""

    def run(self) -> KernelIR:
        Interpreter.run(self)
        (port,), (output,) = self.directions, self.differentiated_outputs
        stored = self.stores[output.name]
        rows = []
        for index in _read_indices(port.shape):
            seed = {self.graph.element(port.name, *index): self.graph.constant(1)}
            rows.append(derivatives([node for _, node in stored], seed))
        kernel = self.kernel
        jacobian_port = Port(
            "J", (len(rows), len(stored)), "", f"{output.name} by {port.name}, transposed"
        )
        return self.graph.kernel(
            f"{kernel.name}_jacobian", kernel.inputs, (jacobian_port,), {"J": rows}, None,
            f"{kernel.name} by {port.name}", kernel.sources,
        )  # fmt: skip


def _derivative_port(port: Port) -> Port:
    return replace(port, name=DERIVATIVE_PREFIX + port.name, meaning=f"derivative of {port.name}")


def _indices(shape: Index) -> list[Index]:
    """All indices of a shape; along the run-time size one loop index represents all."""
    letters = iter(LOOPS)
    ranges = [(next(letters),) if isinstance(extent, str) else range(extent) for extent in shape]
    return list(product(*ranges))


def _read_indices(shape: Index) -> list[Index]:
    """All indices by which a kernel may read an array: both letters along the run-time size."""
    ranges = [LOOPS if isinstance(extent, str) else range(extent) for extent in shape]
    return list(product(*ranges))


def _nest(shape: Index, entries: Mapping[Index, Node], at: Index = ()) -> Any:
    """Nest entries in lists, as `Graph.kernel` expects; None where nothing is stored."""
    if not shape:
        return entries.get(at)
    if isinstance(shape[0], str):
        return _nest(shape[1:], entries, (*at, LOOPS[sum(isinstance(i, str) for i in at)]))
    return [_nest(shape[1:], entries, (*at, i)) for i in range(shape[0])]
