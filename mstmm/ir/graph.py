"""Graph that builds KernelIR by value numbering: equal terms share a node, constants fold.

Derivations are lowered through this graph, and expressions of scene files are parsed into it, so
that C, the tape and the interpreter receive both in the same form.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from .kernel import KernelIR
from .statement_writer import GuardRequest, StoreRequest, Writer
from .statements import Port, Solve
from .terms import Node, Number, Terms

__all__ = ["Graph", "Node", "Number"]


class Graph(Terms):
    """Hash-consed expression graph of one kernel: equal expressions are the same node."""

    def __init__(self) -> None:
        super().__init__()
        #: Guards, solves and stores in the order of their requests.
        self._requests: list[GuardRequest | Solve | StoreRequest] = []

    def guard(self, condition: Node, code: int, message: str) -> None:
        """Leave the kernel with `code` unless `condition` holds.

        ValueError if the condition is known to be false.
        """
        if condition.value is None:
            self._requests.append(GuardRequest(condition, code, message))
        elif condition.value == 0:
            raise ValueError(f"this can never be computed: {message}")

    def solve(
        self, output: str, matrix: str, right: str, code: int, message: str, symmetric: bool = True
    ) -> None:
        """Request a run-time sized solve between readable arrays; the result is `output`."""
        self._requests.append(Solve(output, matrix, right, code, message, symmetric=symmetric))

    def store(self, port: Port, value: object) -> None:
        """Write an output at once (kernels with run-time size), so that it can be read afterwards.

        `value` has the form of `values[port]` of `kernel`.  Once a store is requested, guards,
        solves and stores keep the order of their requests.
        """
        self._requests.append(StoreRequest(port, value))

    # --- linearisation: graph -> KernelIR -------------------------------------------------------

    def kernel(
        self,
        name: str,
        inputs: Sequence[Port],
        outputs: Sequence[Port],
        values: dict[str, object],
        size_symbol: str | None = None,
        purpose: str = "",
        sources: Iterable[str] = (),
        keep_order: bool = False,
    ) -> KernelIR:
        """Build a frozen kernel from the terms that the outputs need (others are dropped).

        With `keep_order` values stay in the order of creation, each guard and store right after
        its operands (kernels without run-time size).  Otherwise they are ordered by the first
        guard or output that needs them.

        `values[port]` is a node, or a nested list of nodes in the port's shape; an entry None is
        not stored.  An axis of the size symbol has no list: one value, which may contain
        `LOOP_INDEX` (for a second such axis `INNER_INDEX`), holds for all k < n.
        """
        writer = Writer(self)
        if keep_order:
            guards = [r for r in self._requests if isinstance(r, GuardRequest)]
            writer.emit_in_creation_order(guards, outputs, values)
            return KernelIR(
                name, tuple(inputs), tuple(outputs), tuple(writer.statements), None, purpose,
                tuple(sources),
            )  # fmt: skip
        requests = self._requests
        if not any(isinstance(r, StoreRequest) for r in requests):
            requests = sorted(requests, key=lambda r: not isinstance(r, Solve))  # solves first
        for request in requests:
            writer.request(request)
        for port in outputs:
            if port.name in values:
                writer.store(port, values[port.name])
        return KernelIR(
            name, tuple(inputs), tuple(outputs), tuple(writer.statements), size_symbol, purpose,
            tuple(sources),
        )  # fmt: skip
