"""When errors are looked at: even times, and more of them where the motion is faster than these.

How fast it is the steps of a run tell that chooses them by itself: where it takes several between
two even times, something happens there that those do not see.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

#: How many times there are at most, in even ones.
_MOST = 4

#: Steps between two even times that tell of a fast motion; runs begin with two or three short ones.
_SEVERAL = 4

#: Times nearer to each other than this part of the run are one.
_SAME = 1e-12


@dataclass(frozen=True)
class Times:
    """Samples (n,) in s, and how they lie in words."""

    at: Array
    words: str


def even(t_end: float, count: int) -> Times:
    """So many times from 0 to t_end."""
    return Times(np.linspace(0.0, t_end, count), f"{count} even times up to {t_end:.6g} s")


def refine_times(times: Times, steps: Array) -> Times:
    """Even times with the ends of steps (m,), in s, where there are several between two of them.

    Of more than there is room for, one in so many.
    """
    first, last = times.at[0], times.at[-1]
    same = _SAME * (last - first)
    inside = steps[(steps > first) & (steps < last)]
    place = np.searchsorted(times.at, inside) - 1
    crowded = np.bincount(place, minlength=len(times.at)) >= _SEVERAL
    apart = np.minimum(inside - times.at[place], times.at[place + 1] - inside) > same
    more = np.unique(inside[crowded[place] & apart])
    room = (_MOST - 1) * len(times.at)
    if len(more) > room:
        more = more[np.linspace(0, len(more) - 1, room).round().astype(int)]
    if not len(more):
        return times
    words = f"{times.words}, and {len(more)} more where the motion is fast"
    return Times(np.union1d(times.at, more), words)
