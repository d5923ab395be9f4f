"""State while one scene is fused: graph, inputs and failures; choice of the cheapest kernels."""

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


# --- choice of kernels ----------------------------------------------------------------------------

#: Axes with screw kernels; a rotation about y uses the general product.
_AXES = ("x", "", "z")


def screw_axis(rotation: Nodes, position: Nodes) -> str:
    """Axis of a screw; "" if it is none or if the plain product folds."""
    for k, axis in enumerate(_AXES):
        if not axis:
            continue
        across = [n for n in range(3) if n != k]
        cross = [rotation[3 * k + n] for n in across]
        cross += [rotation[3 * n + k] for n in across]
        offset = [position[n] for n in across]
        turns = rotation[4 * across[0]].value not in (0, 1, -1)
        if turns and all(x.value == 0 for x in (*cross, *offset)):
            return axis
    return ""


def along_a_screw(rotation: Nodes, position: Nodes, subspace: Nodes) -> bool:
    """Whether a screw about z leaves a subspace along z unchanged."""
    nu = len(subspace) // 6
    across = [subspace[row * nu + k] for row in (0, 1, 3, 4) for k in range(nu)]
    return nu > 0 and screw_axis(rotation, position) == "z" and all(x.value == 0 for x in across)


def unit_row(column: Nodes) -> int | None:
    """Row of the one in a unit vector; None if the column is no unit vector."""
    units = [row for row, entry in enumerate(column) if entry.value == 1]
    if len(units) == 1 and sum(entry.value == 0 for entry in column) == len(column) - 1:
        return units[0]
    return None
