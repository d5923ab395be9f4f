"""Sums of a straight-line kernel, regrouped so that no result waits longer than it must.

A sum written term by term is a chain of additions; its last term may be ready long before the
chain gets there.  Each maximal sum whose partial sums nobody else reads is taken apart and put
together again, terms that are ready early first.  Values change by rounding alone.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping, Sequence

from mstmm.ir import OPERATIONS, Assign, Guard, KernelIR, Operand, Statement, Store, Temporary

#: Cycles that a sum or a product takes; they are one when a product is added.
_SUM = OPERATIONS["add"].latency

#: A signed term: (ready, tie-break, negative, operand, is a product that fuses with an addition).
_Term = tuple[float, int, bool, Operand, bool]


def balance(kernel: KernelIR) -> KernelIR:
    """The same kernel with regrouped sums.  Straight-line kernels only."""
    return _Balance(kernel).run()


class BalancedKernels(Mapping[str, KernelIR]):
    """Kernels with regrouped sums, each made when it is asked for."""

    def __init__(self, *made: KernelIR) -> None:
        self._made = {kernel.name: kernel for kernel in made}
        self._balanced: dict[str, KernelIR] = {}

    def __getitem__(self, name: str) -> KernelIR:
        if name not in self._balanced:
            self._balanced[name] = balance(self._made[name])
        return self._balanced[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._made)

    def __len__(self) -> int:
        return len(self._made)


class _Balance:
    def __init__(self, kernel: KernelIR) -> None:
        self.kernel = kernel
        self.by_number = {s.number: s for s in kernel.statements if isinstance(s, Assign)}
        self.uses: dict[int, int] = {}
        for statement in kernel.statements:
            for operand in operands(statement):
                if isinstance(operand, Temporary):
                    self.uses[operand.number] = self.uses.get(operand.number, 0) + 1
        self.inner = self._inner()
        self.ready: dict[int, float] = {}
        self.statements: list[Statement] = []
        self.names: dict[int, Operand] = {}
        self.next = 0

    def _inner(self) -> set[int]:
        """Partial sums that only one other sum reads."""
        found = set()
        for statement in self.by_number.values():
            if statement.op not in ("add", "sub"):
                continue
            for operand in statement.args:
                if not isinstance(operand, Temporary) or self.uses[operand.number] > 1:
                    continue
                if self.by_number[operand.number].op in ("add", "sub"):
                    found.add(operand.number)
        return found

    def run(self) -> KernelIR:
        k = self.kernel
        for statement in k.statements:
            if isinstance(statement, Assign):
                if statement.number not in self.inner:
                    self._place(statement)
            elif isinstance(statement, Store):
                value = self._renamed(statement.value)
                self.statements.append(Store(statement.port, statement.index, value))
            elif isinstance(statement, Guard):
                condition = self._renamed(statement.condition)
                self.statements.append(Guard(condition, statement.code, statement.message))
            else:
                raise ValueError(f"{k.name}: a run-time sized kernel has no sums to regroup")
        return KernelIR(
            k.name, k.inputs, k.outputs, tuple(self.statements), None, k.purpose, k.sources
        )

    def _renamed(self, operand: Operand) -> Operand:
        return self.names[operand.number] if isinstance(operand, Temporary) else operand

    def _when(self, operand: Operand) -> float:
        return self.ready[operand.number] if isinstance(operand, Temporary) else 0.0

    def _emit(self, op: str, args: Sequence[Operand], ready: float) -> Temporary:
        result = Temporary(self.next)
        self.next += 1
        self.statements.append(Assign(result.number, op, tuple(args)))
        self.ready[result.number] = ready
        return result

    def _place(self, statement: Assign) -> None:
        if statement.op in ("add", "sub"):
            terms = self._terms(statement)
            if len(terms) > 2:
                self.names[statement.number] = self._sum(terms)
                return
        args = [self._renamed(a) for a in statement.args]
        ready = max(map(self._when, args), default=0.0) + OPERATIONS[statement.op].latency
        self.names[statement.number] = self._emit(statement.op, args, ready)

    def _terms(self, statement: Assign) -> list[tuple[bool, Operand]]:
        """(negative, operand) of a sum, partial sums opened."""
        found: list[tuple[bool, Operand]] = []
        stack: list[tuple[bool, Operand]] = []

        def open_sum(sum_: Assign, negative: bool) -> None:
            left, right = sum_.args
            stack.append((negative != (sum_.op == "sub"), right))
            stack.append((negative, left))

        open_sum(statement, False)
        while stack:
            negative, operand = stack.pop()
            if isinstance(operand, Temporary) and operand.number in self.inner:
                open_sum(self.by_number[operand.number], negative)
            else:
                found.append((negative, operand))
        return found

    def _sum(self, terms: list[tuple[bool, Operand]]) -> Temporary:
        heap: list[_Term] = []
        for order, (negative, operand) in enumerate(terms):
            product = (
                isinstance(operand, Temporary)
                and self.uses[operand.number] == 1
                and self.by_number[operand.number].op == "mul"
            )
            renamed = self._renamed(operand)
            ready = self._when(renamed) - (_SUM if product else 0)
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
    """What a straight-line statement reads."""
    if isinstance(statement, Assign):
        return statement.args
    if isinstance(statement, Store):
        return (statement.value,)
    if isinstance(statement, Guard):
        return (statement.condition,)
    raise ValueError("a run-time sized statement has no place here")
