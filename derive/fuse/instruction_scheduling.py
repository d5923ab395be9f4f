"""Statement order of straight-line code, for latencies (short code) or registers (long code)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from mstmm.ir import OPERATIONS, Assign, Guard, Store, Temporary
from mstmm.ir.statements import operands

Line = Assign | Store | Guard


def units_of(statements: Sequence[Line]) -> list[list[Line]]:
    """Statements one by one, but a product together with the only sum that reads it (fused)."""
    readers: dict[int, int] = {}
    for statement in statements:
        for number in _temporaries_read(statement):
            readers[number] = readers.get(number, 0) + 1
    products = {
        s.number: s
        for s in statements
        if isinstance(s, Assign) and s.op == "mul" and readers.get(s.number) == 1
    }
    fused: dict[int, Assign] = {}
    for index, statement in enumerate(statements):
        if isinstance(statement, Assign) and statement.op in ("add", "sub"):
            numbers = [number for number in _temporaries_read(statement) if number in products]
            if numbers:
                fused[index] = products.pop(numbers[0])
    fused_numbers = {product.number for product in fused.values()}
    return [
        [fused[index], s] if index in fused else [s]
        for index, s in enumerate(statements)
        if not (isinstance(s, Assign) and s.number in fused_numbers)
    ]


def _temporaries_read(statement: Line) -> list[int]:
    return [a.number for a in operands(statement) if isinstance(a, Temporary)]


def reads_of(units: Sequence[Sequence[Line]]) -> list[set[int]]:
    """Units that each unit depends on; guards keep their order."""
    makers = {s.number: k for k, unit in enumerate(units) for s in unit if isinstance(s, Assign)}
    dependencies = [
        {makers[n] for s in unit for n in _temporaries_read(s) if n in makers and makers[n] != k}
        for k, unit in enumerate(units)
    ]
    guards = [k for k, unit in enumerate(units) if isinstance(unit[-1], Guard)]
    for earlier, later in pairwise(guards):
        dependencies[later].add(earlier)
    return dependencies


# --- order ----------------------------------------------------------------------------------------
# A sweep has independent parts: what the pivots need (inertias, from the tips), motion (from the
# root), and what needs both.  Each is a chain in which every body depends on its neighbour, and the
# processor's look-ahead of a few hundred instructions is shorter than a part.  So in short code the
# parts are merged by a list scheduler that keeps the order within each part: register lifetimes
# hardly grow, and latencies overlap.
#
# In long code the extra spills cost more than the latency saved.  It is limited by its
# instructions, and a spilled value costs two of the slowest.  Among the next statements the first
# one is chosen that frees more registers than it takes; a statement moves by at most the window
# length.

# --- short code: independent parts interleaved ----------------------------------------------------

#: Operations issued per cycle, and look-ahead into one part.
_WIDTH, _PART_WINDOW = 4, 8


def interleave(statements: Sequence[Line]) -> list[Line]:
    """Same statements with the independent parts interleaved; dependencies are kept."""
    units = units_of(statements)
    dependencies = reads_of(units)
    order = _issue_order(
        _independent_parts(units, dependencies), dependencies, [_latency(unit) for unit in units]
    )
    return [statement for k in order for statement in units[k]]


def _issue_order(
    parts: Sequence[list[int]], dependencies: Sequence[set[int]], latency: Sequence[int]
) -> list[int]:
    """Units in the order in which a machine issues them, cycle by cycle."""
    missing = [len(reads) for reads in dependencies]
    after: list[list[int]] = [[] for _ in dependencies]
    for k, reads in enumerate(dependencies):
        for j in reads:
            after[j].append(k)
    ready = [0] * len(dependencies)
    order: list[int] = []
    cycle = 0
    while len(order) < len(dependencies):
        issued = 0
        for part in parts:
            for k in part[:_PART_WINDOW]:
                if missing[k] or ready[k] > cycle or issued >= _WIDTH:
                    continue
                part.remove(k)
                order.append(k)
                issued += latency[k] > 0
                for j in after[k]:
                    missing[j] -= 1
                    ready[j] = max(ready[j], cycle + latency[k])
        cycle += 1
    return order


def _independent_parts(
    units: Sequence[Sequence[Line]], dependencies: Sequence[set[int]]
) -> list[list[int]]:
    """Units that guards need, units independent of them, and the rest; order is kept."""
    guarded: set[int] = set()
    stack = [k for k, unit in enumerate(units) if isinstance(unit[-1], Guard)]
    while stack:
        k = stack.pop()
        if k not in guarded:
            guarded.add(k)
            stack.extend(dependencies[k])
    reached: set[int] = set(guarded)
    for k in range(len(units)):
        if not reached.isdisjoint(dependencies[k]):
            reached.add(k)
    dependent, indices = reached - guarded, range(len(units))
    return [
        [k for k in indices if k in guarded],
        [k for k in indices if k not in reached],
        [k for k in indices if k in dependent],
    ]


def _latency(unit: Sequence[Line]) -> int:
    last = unit[-1]
    return OPERATIONS[last.op].latency if isinstance(last, Assign) else 0


# --- long code: few values in registers -----------------------------------------------------------

#: Window length in statements (measured: 20 to 100 perform the same, 1000 is worse).
_REGISTER_WINDOW = 60


def order_for_registers(statements: Sequence[Line]) -> list[Line]:
    """Order statements so that few values are alive at a time; dependencies are kept."""
    units = units_of(statements)
    return [statement for k in _register_order(reads_of(units)) for statement in units[k]]


def _register_order(dependencies: Sequence[set[int]]) -> list[int]:
    """Order of units: in the window, the first computable one with the largest gain."""
    readers: list[list[int]] = [[] for _ in dependencies]
    for k, reads in enumerate(dependencies):
        for j in reads:
            readers[j].append(k)
    remaining = [len(reads_of_unit) for reads_of_unit in readers]
    missing = [len(reads) for reads in dependencies]
    # Gain: registers freed by a unit less those taken.
    gain = [
        sum(remaining[j] == 1 for j in reads) - (remaining[k] > 0)
        for k, reads in enumerate(dependencies)
    ]
    order: list[int] = []
    window = list(range(min(_REGISTER_WINDOW, len(dependencies))))
    following = len(window)
    done = [False] * len(dependencies)
    while window:
        best = -1
        for position, k in enumerate(window):
            if missing[k] == 0 and (best < 0 or gain[k] > gain[window[best]]):
                best = position
                if gain[k] > 0:
                    break
        chosen = window.pop(best)
        if following < len(dependencies):
            window.append(following)
            following += 1
        order.append(chosen)
        done[chosen] = True
        for k in readers[chosen]:
            missing[k] -= 1
        for j in dependencies[chosen]:
            remaining[j] -= 1
            if remaining[j] == 1:
                gain[next(k for k in readers[j] if not done[k])] += 1
    return order
