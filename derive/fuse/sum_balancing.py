"""Regrouped sums of a straight-line kernel: shorter dependency chains.

A sum written term by term is a chain of additions; its last term may be ready long before the chain
reaches it.  Each maximal sum whose partial sums have no other reader is split and rebuilt with
early terms first.  Values change by rounding only.  Sines and cosines are gathered in levels that
can be computed together.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from mstmm.ir import OPERATIONS, Assign, Guard, KernelIR, Operand, Statement, Store, Temporary
from mstmm.ir.statements import operands

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


# --- pairs of sines and cosines -------------------------------------------------------------------
# Sine and cosine of one argument cost little more than either; four arguments in a vector cost
# about as much as one.  Arguments are sorted by the number of sines that they depend on in
# sequence: those that need none (coordinates, times, sums of them) are computed first and
# together.


@dataclass
class Angle:
    """One argument, and the temporaries of its sine and cosine."""

    argument: Operand
    sines: list[int] = field(default_factory=list)
    cosines: list[int] = field(default_factory=list)


@dataclass
class Level:
    """Statements that need the angles of earlier levels, then the angles of this level."""

    statements: list[Assign] = field(default_factory=list)
    angles: list[Angle] = field(default_factory=list)


@dataclass(frozen=True)
class SincosLevels:
    """Statements of a kernel with its angles extracted: levels first, then the rest."""

    levels: tuple[Level, ...]
    remaining: tuple[Assign | Store | Guard, ...]

    def defined_temporaries(self) -> list[int]:
        """Temporaries that the levels define."""
        numbers = []
        for level in self.levels:
            numbers += [statement.number for statement in level.statements]
            numbers += [n for angle in level.angles for n in (*angle.sines, *angle.cosines)]
        return numbers


def gather(statements: Sequence[Statement]) -> SincosLevels:
    """Extract sines and cosines from straight-line code, each as early as its argument allows.

    Statements that no argument needs keep their order and follow the last level.
    """
    depth: dict[int, int] = {}
    angles: dict[Operand, Angle] = {}
    needed: dict[int, Assign] = {}
    for statement in statements:
        if not isinstance(statement, Assign):
            continue
        needed[statement.number] = statement
        level = max((_depth(a, depth) for a in statement.args), default=0)
        if statement.op not in ("sin", "cos"):
            depth[statement.number] = level
            continue
        depth[statement.number] = level + 1
        angle = angles.setdefault(statement.args[0], Angle(statement.args[0]))
        (angle.sines if statement.op == "sin" else angle.cosines).append(statement.number)
    levels = [Level() for _ in range(max(depth.values(), default=0))]
    for argument, angle in angles.items():
        levels[_depth(argument, depth)].angles.append(angle)
    return _fill_levels(levels, statements, needed)


def _depth(operand: Operand, depth: dict[int, int]) -> int:
    return depth[operand.number] if isinstance(operand, Temporary) else 0


def _fill_levels(
    levels: Sequence[Level], statements: Sequence[Statement], assigns: dict[int, Assign]
) -> SincosLevels:
    """Move the statements that the levels' arguments need in front of them."""
    position_of = {number: position for position, number in enumerate(assigns)}
    done: set[int] = {
        number
        for level in levels
        for angle in level.angles
        for number in (*angle.sines, *angle.cosines)
    }
    for level in levels:
        missing = _missing_temporaries((angle.argument for angle in level.angles), assigns, done)
        level.statements = [
            assigns[number] for number in sorted(missing, key=position_of.__getitem__)
        ]
        done |= missing
    rest = tuple(
        s
        for s in statements
        if isinstance(s, (Store, Guard)) or (isinstance(s, Assign) and s.number not in done)
    )
    return SincosLevels(tuple(levels), rest)


def _missing_temporaries(
    roots: Iterable[Operand], assigns: dict[int, Assign], done: set[int]
) -> set[int]:
    """Temporaries that `roots` depend on and that are not yet computed."""
    missing: set[int] = set()
    stack = list(roots)
    while stack:
        operand = stack.pop()
        if isinstance(operand, Temporary) and operand.number not in missing | done:
            missing.add(operand.number)
            stack.extend(operands(assigns[operand.number]))
    return missing
