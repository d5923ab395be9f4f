"""State while one scene is fused: graph, inputs and failures."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mstmm.ir import KernelIR
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Inliner, Nodes
from mstmm.ir.scene_structure import Entries, ExpressionStructure, Key, Structure

#: (element, kernel name) -> its IR.
Kernels = Callable[[Key, str], KernelIR]


class FusionState:
    """Graph, parameter values and inputs of a scene that is being fused.

    `failures` may be a list shared with other kernels of the same library; new ones are
    appended.
    """

    def __init__(
        self,
        structure: Structure,
        kernels: Kernels,
        numbers: Sequence[float] | None,
        failures: list[tuple[int, int, int]] | None = None,
    ) -> None:
        self.structure, self.kernels, self.numbers = structure, kernels, numbers
        self.graph = Graph()
        self.inline = Inliner(self.graph)
        self.zero, self.one = self.inline.zero, self.inline.one
        self.failures = [] if failures is None else failures
        self.t = self.graph.element("t", 0)
        self.q = self.graph.vector("q", structure.nq)
        self.u = self.graph.vector("u", structure.nu)
        self.efforts = self.graph.vector("efforts", structure.nu)
        self.given_accelerations = self.graph.vector("a", structure.nu)
        self.memory = self.graph.vector("memory", structure.n_memory)

    def entries(self, entries: Entries) -> Nodes:
        """Nodes of structural constants (float) and of parameters (index into p)."""
        return [self._entry(entry) for entry in entries]

    def _entry(self, entry: float | int) -> Node:
        if isinstance(entry, float):
            return self.graph.constant(entry)
        if self.numbers is not None:
            return self.graph.constant(self.numbers[entry])
        return self.graph.element("p", entry)

    def expression(self, source: ExpressionStructure, **extra: Sequence[Node]) -> Nodes:
        """Values of the scene's expressions."""
        available: dict[str, Sequence[Node]] = {
            "t": [self.t], "q": self.q, "u": self.u, "constants": self.entries(source.constants),
        }  # fmt: skip
        available |= extra
        inputs = {port.name: available[port.name] for port in source.kernel.inputs}
        return next(iter(self.inline.run(source.kernel, inputs).values()))

    def fail_unless(self, condition: Node, reason: int, element: int, code: int) -> None:
        """Add the guard that reproduces a failure of the looped engine."""
        failure = (reason, element, code)
        if failure not in self.failures:
            self.failures.append(failure)
        self.graph.guard(condition, 1 + self.failures.index(failure), f"failure {failure}")

    def identity(self) -> Nodes:
        return [self.one if i % 4 == 0 else self.zero for i in range(9)]

    def zeros(self, count: int) -> Nodes:
        return [self.zero] * count
