"""Order of a straight line's statements: few values in registers at a time.

A long kernel waits for its own instructions, and every value that leaves the registers and comes
back costs two of the longest.  So among the next statements in the order of the graph the one comes
first that frees more registers than it takes; a statement moves at most a window's length.
"""

from __future__ import annotations

from collections.abc import Sequence

from .statement_units import Line, reads_of, units_of

#: How far a statement may be brought forward (measured: 20 to 100 are alike, 1000 is worse).
_WINDOW = 60


def thrifty(statements: Sequence[Line]) -> list[Line]:
    """The same statements; each behind what it reads, last readers of a value early."""
    units = units_of(statements)
    return [statement for k in _order(reads_of(units)) for statement in units[k]]


def _order(before: Sequence[set[int]]) -> list[int]:
    """Unit by unit: of those in the window that can be computed, the first with the most gain."""
    readers: list[list[int]] = [[] for _ in before]
    for k, reads in enumerate(before):
        for j in reads:
            readers[j].append(k)
    left = [len(found) for found in readers]
    missing = [len(reads) for reads in before]
    # Registers freed by a unit less those taken.
    gain = [sum(left[j] == 1 for j in reads) - (left[k] > 0) for k, reads in enumerate(before)]
    order: list[int] = []
    window = list(range(min(_WINDOW, len(before))))
    following = len(window)
    done = [False] * len(before)
    while window:
        best = -1
        for place, k in enumerate(window):
            if missing[k] == 0 and (best < 0 or gain[k] > gain[window[best]]):
                best = place
                if gain[k] > 0:
                    break
        chosen = window.pop(best)
        if following < len(before):
            window.append(following)
            following += 1
        order.append(chosen)
        done[chosen] = True
        for k in readers[chosen]:
            missing[k] -= 1
        for j in before[chosen]:
            left[j] -= 1
            if left[j] == 1:
                gain[next(k for k in readers[j] if not done[k])] += 1
    return order
