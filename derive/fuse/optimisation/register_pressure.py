"""Statement order of straight-line code that keeps few values in registers at a time.

A long kernel is limited by its instructions, and a spilled value costs two of the slowest.  Among
the next statements the first one is chosen that frees more registers than it takes; a statement
moves by at most the window length.
"""

from __future__ import annotations

from collections.abc import Sequence

from .statement_units import Line, reads_of, units_of

#: Window length in statements (measured: 20 to 100 perform the same, 1000 is worse).
_WINDOW = 60


def thrifty(statements: Sequence[Line]) -> list[Line]:
    """Same statements with last readers of a value early; dependencies are kept."""
    units = units_of(statements)
    return [statement for k in _order(reads_of(units)) for statement in units[k]]


def _order(dependencies: Sequence[set[int]]) -> list[int]:
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
    window = list(range(min(_WINDOW, len(dependencies))))
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
