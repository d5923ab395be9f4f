"""Order of a straight line's statements: independent parts of a sweep side by side.

A sweep has parts that do not wait for one another: what the pivots need (inertias, from the tips),
motion (from the root), and what needs both.  Each is a chain in which every body waits for its
neighbour, and a processor looks ahead a few hundred instructions, less than a part is long.  So the
parts are merged, cycle by cycle, as a machine would start them that takes each part nearly in its
own order: registers last as long as they did, and the waiting is shared.

Pays while the code is short; in long code the extra spills cost more than the waiting.
"""

from __future__ import annotations

from collections.abc import Sequence

from mstmm.ir import OPERATIONS, Assign, Guard

from .statement_units import Line, reads_of, units_of

#: Operations that start in a cycle, and how far a part is looked ahead into.
_WIDTH, _WINDOW = 4, 8


def interleave(statements: Sequence[Line]) -> list[Line]:
    """The same statements; each behind what it reads, the parts side by side."""
    units = units_of(statements)
    before = reads_of(units)
    order = _started(_parts(units, before), before, [_latency(unit) for unit in units])
    return [statement for k in order for statement in units[k]]


def _started(
    parts: Sequence[list[int]], before: Sequence[set[int]], latency: Sequence[int]
) -> list[int]:
    """The units in the order in which a machine starts them, cycle by cycle."""
    missing = [len(reads) for reads in before]
    after: list[list[int]] = [[] for _ in before]
    for k, reads in enumerate(before):
        for j in reads:
            after[j].append(k)
    ready = [0] * len(before)
    order: list[int] = []
    cycle = 0
    while len(order) < len(before):
        started = 0
        for part in parts:
            for k in part[:_WINDOW]:
                if missing[k] or ready[k] > cycle or started >= _WIDTH:
                    continue
                part.remove(k)
                order.append(k)
                started += latency[k] > 0
                for j in after[k]:
                    missing[j] -= 1
                    ready[j] = max(ready[j], cycle + latency[k])
        cycle += 1
    return order


def _parts(units: Sequence[Sequence[Line]], before: Sequence[set[int]]) -> list[list[int]]:
    """What guards judge; what waits for none of that; the rest.  Each in its old order."""
    judged: set[int] = set()
    stack = [k for k, unit in enumerate(units) if isinstance(unit[-1], Guard)]
    while stack:
        k = stack.pop()
        if k not in judged:
            judged.add(k)
            stack.extend(before[k])
    waiting: set[int] = set(judged)
    for k in range(len(units)):
        if not waiting.isdisjoint(before[k]):
            waiting.add(k)
    both, every = waiting - judged, range(len(units))
    return [
        [k for k in every if k in judged],
        [k for k in every if k not in waiting],
        [k for k in every if k in both],
    ]


def _latency(unit: Sequence[Line]) -> int:
    last = unit[-1]
    return OPERATIONS[last.op].latency if isinstance(last, Assign) else 0
