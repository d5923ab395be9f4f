"""Builds KernelIR by value numbering: equal terms are one node, constants fold as they arise.

Derivations are lowered through this graph, and expressions of scene files are parsed into it, so
that both reach C, the tape and the evaluator in the same form.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from .kernel import KernelIR
from .statements import Port, Solve
from .terms import Node, Number, Terms
from .writer import GuardRequest, StoreRequest, Writer

__all__ = ["Graph", "Node", "Number"]


class Graph(Terms):
    """Hash-consed expression graph of one kernel."""

    def __init__(self) -> None:
        super().__init__()
        #: Guards, solves and stores in the order in which they were asked for.
        self._requests: list[GuardRequest | Solve | StoreRequest] = []

    def guard(self, condition: Node, code: int, message: str) -> None:
        """Leave with `code` unless `condition` holds."""
        if condition.value is None:
            self._requests.append(GuardRequest(condition, code, message))
        elif condition.value == 0:
            raise ValueError(f"this can never be computed: {message}")

    def solve(
        self, output: str, matrix: str, right: str, code: int, message: str, symmetric: bool = True
    ) -> None:
        """Run-time sized solve between readable arrays; the result is the named output."""
        self._requests.append(Solve(output, matrix, right, code, message, symmetric=symmetric))

    def store(self, port: Port, value: object) -> None:
        """Write an output now (kernels with run-time size), so that it can be read afterwards.

        `value` is what `kernel` takes as `values[port]`.  With a store asked for, guards, solves
        and stores keep the order in which they were asked for.
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
        as_made: bool = False,
    ) -> KernelIR:
        """Order what the outputs need (dead terms drop out) into a frozen kernel.

        With `as_made` values stand in the order in which they were made, each guard and store
        right behind what it waits for (kernels without run-time size); otherwise in the order in
        which guards and outputs ask for them.

        `values[port]` is a node, or a nested list of nodes in the port's shape; an entry None is
        not stored.  An axis of the size symbol has no list: one value, which may contain
        `LOOP_INDEX` (for a second such axis `INNER_INDEX`), stands for all k < n.
        """
        writer = Writer(self)
        if as_made:
            guards = [r for r in self._requests if isinstance(r, GuardRequest)]
            writer.as_made(guards, outputs, values)
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
