"""Regrouped sums of a straight-line kernel: shorter dependency chains.

A sum written term by term is a chain of additions; its last term may be ready long before the chain
reaches it.  Each maximal sum whose partial sums have no other reader is split and rebuilt with
early terms first.  Values change by rounding only.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping, Sequence

from mstmm.ir import OPERATIONS, Assign, Guard, KernelIR, Operand, Statement, Store, Temporary

#: Latency of a sum or a product in cycles; an added product is fused and counts once.
_SUM = OPERATIONS["add"].latency

#: A signed term: (ready, tie-break, negative, operand, is a product that fuses with an addition).
_Term = tuple[float, int, bool, Operand, bool]


def balance(kernel: KernelIR) -> KernelIR:
    """Same kernel with regrouped sums; straight-line kernels only."""
    return _Balance(kernel).run()


class BalancedKernels(Mapping[str, KernelIR]):
    """Kernels with regrouped sums, each computed on first access."""

    def __init__(self, *kernels: KernelIR) -> None:
        self._originals = {kernel.name: kernel for kernel in kernels}
        self._balanced: dict[str, KernelIR] = {}

    def __getitem__(self, name: str) -> KernelIR:
        if name not in self._balanced:
            self._balanced[name] = balance(self._originals[name])
        return self._balanced[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._originals)

    def __len__(self) -> int:
        return len(self._originals)


class _Balance:
    def __init__(self, kernel: KernelIR) -> None:
        self.kernel = kernel
        self.assignments = {s.number: s for s in kernel.statements if isinstance(s, Assign)}
        self.uses: dict[int, int] = {}
        for statement in kernel.statements:
            for operand in operands(statement):
                if isinstance(operand, Temporary):
                    self.uses[operand.number] = self.uses.get(operand.number, 0) + 1
        self.inner = self._inner_sums()
        self.ready: dict[int, float] = {}
        self.statements: list[Statement] = []
        self.names: dict[int, Operand] = {}
        self.next = 0

    def _inner_sums(self) -> set[int]:
        """Partial sums that only one other sum reads."""
        numbers = set()
        for statement in self.assignments.values():
            if statement.op not in ("add", "sub"):
                continue
            for operand in statement.args:
                if not isinstance(operand, Temporary) or self.uses[operand.number] > 1:
                    continue
                if self.assignments[operand.number].op in ("add", "sub"):
                    numbers.add(operand.number)
        return numbers

    def run(self) -> KernelIR:
        k = self.kernel
        for statement in k.statements:
            if isinstance(statement, Assign):
                if statement.number not in self.inner:
                    self._add_statement(statement)
            elif isinstance(statement, Store):
                value = self._new_operand(statement.value)
                self.statements.append(Store(statement.port, statement.index, value))
            elif isinstance(statement, Guard):
                condition = self._new_operand(statement.condition)
                self.statements.append(Guard(condition, statement.code, statement.message))
            else:
                raise ValueError(f"{k.name}: expected a kernel of fixed size")
        return KernelIR(
            k.name, k.inputs, k.outputs, tuple(self.statements), None, k.purpose, k.sources
        )

    def _new_operand(self, operand: Operand) -> Operand:
        return self.names[operand.number] if isinstance(operand, Temporary) else operand

    def _ready_time(self, operand: Operand) -> float:
        return self.ready[operand.number] if isinstance(operand, Temporary) else 0.0

    def _emit(self, op: str, args: Sequence[Operand], ready: float) -> Temporary:
        result = Temporary(self.next)
        self.next += 1
        self.statements.append(Assign(result.number, op, tuple(args)))
        self.ready[result.number] = ready
        return result

    def _add_statement(self, statement: Assign) -> None:
        if statement.op in ("add", "sub"):
            terms = self._terms(statement)
            if len(terms) > 2:
                self.names[statement.number] = self._balanced_sum(terms)
                return
        args = [self._new_operand(a) for a in statement.args]
        ready = max(map(self._ready_time, args), default=0.0) + OPERATIONS[statement.op].latency
        self.names[statement.number] = self._emit(statement.op, args, ready)

    def _terms(self, statement: Assign) -> list[tuple[bool, Operand]]:
        """(negative, operand) of a sum with its partial sums expanded."""
        terms: list[tuple[bool, Operand]] = []
        stack: list[tuple[bool, Operand]] = []

        def open_sum(total: Assign, negative: bool) -> None:
            left, right = total.args
            stack.append((negative != (total.op == "sub"), right))
            stack.append((negative, left))

        open_sum(statement, False)
        while stack:
            negative, operand = stack.pop()
            if isinstance(operand, Temporary) and operand.number in self.inner:
                open_sum(self.assignments[operand.number], negative)
            else:
                terms.append((negative, operand))
        return terms

    def _balanced_sum(self, terms: list[tuple[bool, Operand]]) -> Temporary:
        heap: list[_Term] = []
        for order, (negative, operand) in enumerate(terms):
            product = (
                isinstance(operand, Temporary)
                and self.uses[operand.number] == 1
                and self.assignments[operand.number].op == "mul"
            )
            renamed = self._new_operand(operand)
            ready = self._ready_time(renamed) - (_SUM if product else 0)
            heapq.heappush(heap, (ready, order, negative, renamed, product))
        order = len(terms)
        while len(heap) > 1:
            a, b = heapq.heappop(heap), heapq.heappop(heap)
            wait = max(a[0] + (_SUM if a[4] and b[4] else 0), b[0]) + _SUM
            if a[2] == b[2]:
                result, negative = self._emit("add", (a[3], b[3]), wait), a[2]
            else:
                plus, minus = (b, a) if a[2] else (a, b)
                result, negative = self._emit("sub", (plus[3], minus[3]), wait), False
            heapq.heappush(heap, (wait, order, negative, result, False))
            order += 1
        ready, _, negative, total, _ = heap[0]
        if negative:
            return self._emit("neg", (total,), ready + OPERATIONS["neg"].latency)
        assert isinstance(total, Temporary)
        return total


def operands(statement: Statement) -> tuple[Operand, ...]:
    """Operands that a straight-line statement reads."""
    if isinstance(statement, Assign):
        return statement.args
    if isinstance(statement, Store):
        return (statement.value,)
    if isinstance(statement, Guard):
        return (statement.condition,)
    raise ValueError(f"expected a straight-line statement, found {type(statement).__name__}")
