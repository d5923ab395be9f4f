"""Order of the statements of a straight-line kernel: what others wait for longest comes first.

A processor looks a few hundred instructions ahead, far less than a fused sweep is long, so the
independent parts of the sweep (S from the tips, motion from the root) run side by side only where
their statements stand side by side.  This is list scheduling by critical path for a machine that
starts a few operations a cycle; compilers for x86 keep the order they are given.
"""

from __future__ import annotations

import heapq

from mstmm.ir import Assign, KernelIR, Statement, Temporary

from .balance import LATENCY, USUAL_LATENCY, operands


def schedule(kernel: KernelIR, width: int) -> KernelIR:
    """The same statements in an order for a machine that starts `width` operations a cycle."""
    statements = kernel.statements
    needs, users = _dependencies(statements)
    latency = [LATENCY.get(s.op, USUAL_LATENCY) if isinstance(s, Assign) else 0 for s in statements]
    urgency = [0] * len(statements)
    for i in reversed(range(len(statements))):
        urgency[i] = latency[i] + max((urgency[j] for j in users[i]), default=0)
    order = _order(
        needs, users, latency, urgency, width, [isinstance(s, Assign) for s in statements]
    )
    return KernelIR(
        kernel.name, kernel.inputs, kernel.outputs, tuple(statements[i] for i in order), None,
        kernel.purpose, kernel.sources,
    )  # fmt: skip


def _dependencies(statements: tuple[Statement, ...]) -> tuple[list[int], list[list[int]]]:
    """(how many statements each waits for, the statements that wait for each)."""
    maker: dict[int, int] = {}
    needs: list[int] = []
    users: list[list[int]] = [[] for _ in statements]
    for i, statement in enumerate(statements):
        before = {maker[a.number] for a in operands(statement) if isinstance(a, Temporary)}
        needs.append(len(before))
        for j in sorted(before):
            users[j].append(i)
        if isinstance(statement, Assign):
            maker[statement.number] = i
    return needs, users


def _order(
    needs: list[int],
    users: list[list[int]],
    latency: list[int],
    urgency: list[int],
    width: int,
    costs: list[bool],
) -> list[int]:
    """Cycle by cycle the most urgent statements whose operands are there; stores cost nothing."""
    left = list(needs)
    ready = [0] * len(needs)
    now = [(-urgency[i], i) for i, n in enumerate(left) if n == 0]
    heapq.heapify(now)
    later: list[tuple[int, int]] = []
    order: list[int] = []
    cycle = 0
    while len(order) < len(needs):
        while later and later[0][0] <= cycle:
            _, i = heapq.heappop(later)
            heapq.heappush(now, (-urgency[i], i))
        started = 0
        while now and started < width:
            _, i = heapq.heappop(now)
            order.append(i)
            started += costs[i]
            for j in users[i]:
                left[j] -= 1
                ready[j] = max(ready[j], cycle + latency[i])
                if left[j] == 0:
                    heapq.heappush(later, (ready[j], j))
        cycle = cycle + 1 if now else max(cycle + 1, later[0][0] if later else 0)
    return order
