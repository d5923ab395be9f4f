"""Times at which errors are evaluated: equidistant, with more where the motion is fast.

The steps of a run with step size control show where that is: several steps between two equidistant
times mean motion that these times would miss.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

#: Largest number of times, relative to the equidistant ones.
_MAX_COUNT_FACTOR = 4

#: Steps between two equidistant times that indicate fast motion; every run begins with two or three
#: short steps, which do not.
_FAST_STEP_COUNT = 4

#: Times closer together than this fraction of the run are merged.
_MERGE_FRACTION = 1e-12


@dataclass(frozen=True)
class Times:
    """Times of samples (n,), s, and a description of their distribution."""

    times: Array
    description: str


def equidistant_times(t_end: float, count: int) -> Times:
    """Equidistant times from 0 to t_end, s."""
    return Times(np.linspace(0.0, t_end, count), f"{count} equidistant times up to {t_end:.6g} s")


def refine_times(times: Times, steps: Array) -> Times:
    """Add the ends of steps (m,), s, to the intervals that contain several of them.

    Additional times beyond the largest number allowed are thinned out evenly.
    """
    first, last = times.times[0], times.times[-1]
    min_distance = _MERGE_FRACTION * (last - first)
    inside = steps[(steps > first) & (steps < last)]
    interval = np.searchsorted(times.times, inside) - 1
    is_fast = np.bincount(interval, minlength=len(times.times)) >= _FAST_STEP_COUNT
    distances = np.minimum(inside - times.times[interval], times.times[interval + 1] - inside)
    added = np.unique(inside[is_fast[interval] & (distances > min_distance)])
    max_count = (_MAX_COUNT_FACTOR - 1) * len(times.times)
    if len(added) > max_count:
        added = added[np.linspace(0, len(added) - 1, max_count).round().astype(int)]
    if not len(added):
        return times
    words = f"{times.description}, and {len(added)} more where the motion is fast"
    return Times(np.union1d(times.times, added), words)
