"""Statement order of straight-line code: independent parts of a sweep are interleaved.

A sweep has independent parts: what the pivots need (inertias, from the tips), motion (from the
root), and what needs both.  Each is a chain in which every body depends on its neighbour, and the
processor's look-ahead of a few hundred instructions is shorter than a part.  So the parts are
merged by a list scheduler that keeps the order within each part: register lifetimes hardly grow,
and latencies overlap.

Worthwhile only for short code; in long code the extra spills cost more than the latency saved.
"""

from __future__ import annotations

from collections.abc import Sequence

from mstmm.ir import OPERATIONS, Assign, Guard

from .statement_units import Line, reads_of, units_of

#: Operations issued per cycle, and look-ahead into one part.
_WIDTH, _WINDOW = 4, 8


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
            for k in part[:_WINDOW]:
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
