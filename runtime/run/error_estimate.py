"""Error of a run from a second, more accurate one.

The second run has a hundredth of the tolerance (or half the fixed step).  The difference of the
two is the error of the first up to the much smaller one of the second.  What is reported is SAFETY
times the largest difference so far, so that a moment at which the two happen to cross does not pass
for accuracy.  It holds until the two runs part for good: past that time (the predictability
horizon) errors have no meaning, because neither run knows where the system is.

The second run must differ in its steps, or it repeats the error of the first: where breaks and the
end cut the steps of the first run, those of the second are shorter than the pieces; and a tolerance
so loose that it bounds nothing is no measure of the second one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mstmm.array_validation import Array

from ..integrate.settings import Settings
from ..packing.coordinate_layout import Layout
from .trajectory import Trajectory

#: The estimate is this many times the difference of the two runs.
SAFETY = 2.0

#: A sample's estimate also covers this many samples after it: the two runs may cross at one.
AHEAD = 3

#: Tolerance of the second run in that of the first.  With a tenth its error is not always the
#: smaller one: over 800 estimates of random scenes the ratio to the true error was 0.5 to 38 with a
#: tenth, 1.2 to 5.2 with a hundredth.
TIGHTER = 0.01

#: Angles (rad): two runs that differ by more no longer predict the same motion.
ANGLE = 0.01

#: The same for other coordinates, as part of their largest excursion.
PART = 0.01

#: Longest step of the second run in the longest one of the first: where both took long steps, the
#: second one looks at other states and times.
_ELSEWHERE = 0.37

#: No tolerance is tightened below this.
_TIGHTEST = 1e-14

#: The second run's tolerance is at most this, its absolute one this part of the motion's size.
_LOOSEST = 1e-4

#: Motions and errors below this are rounding: no tolerance follows them.
_DUST = 1e-12

#: Steps of the second run, at least, where the step is fixed.
_FEWEST = 64

#: Pieces between breaks that make up less than this part of the run are not halved.
_MINOR = 0.01

#: Growth of the error that counts as exponential, and as noise of rounding at its start.
_GROWTH, _SMALLEST = 1e3, 1e-15


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated error of a run: largest so far, per unit.

    Attributes:
        t: (n,) s, the samples that both runs reached.
        q: unit -> (n,) largest error of any coordinate of that unit up to t; the rotation error of
            a quaternion counts as rad.
        u: unit -> (n,) the same for speeds.
        horizon: s; the runs part here, None if they do not.
        tenfold: s in which errors grow tenfold, None if they do not grow exponentially.
        reference: how the second run was made.
        moved: unit -> how far coordinates of that unit went, against which errors are judged.
        covered: s up to which the second run went where it failed before the end of the first:
            nothing is known of the error beyond; None for the whole run.
    """

    t: Array
    q: dict[str, Array]
    u: dict[str, Array]
    horizon: float | None
    tenfold: float | None
    reference: str
    moved: dict[str, float] = field(default_factory=dict)
    covered: float | None = None

    @property
    def nowhere(self) -> bool:
        """Whether the runs part at the first sample already behind the start, if not there."""
        return self.horizon is not None and self.horizon <= self.t[0]

    def whole(self, kind: str = "q") -> dict[str, float]:
        """Unit -> largest difference of the two runs as far as both went, as an error, whatever
        the horizon."""
        values: dict[str, Array] = getattr(self, kind)
        return {unit: float(v.max(initial=0.0)) for unit, v in values.items()}

    def largest(self, kind: str = "q") -> dict[str, float]:
        """Unit -> largest error of q or u before the horizon (as far as both runs went without
        one)."""
        within = self.t < np.inf if self.horizon is None else self.t <= self.horizon
        values: dict[str, Array] = getattr(self, kind)
        return {unit: float(v[within].max(initial=0.0)) for unit, v in values.items()}


def reference_settings(first: Trajectory, breaks: Sequence[float] = ()) -> tuple[Settings, str]:
    """Settings of the second run, sampled at the times of the first; and what to call it.

    `breaks` are the times (s) at which the scene ends every step.
    """
    settings, times = first.settings, tuple(np.unique(first.t).tolist())
    pieces = _pieces(settings, breaks)
    if settings.step is not None:
        half = settings.step / 2
        cut = min(_typical(np.minimum(pieces, settings.step), pieces) / 2, pieces.sum() / _FEWEST)
        step = min(half, cut) if cut > 0 else half
        name = "half the step" if step == half else "a shorter step"
        return replace(settings, step=step, output_times=times), f"{name}, {step:.6g} s"
    factor = max(TIGHTER, _TIGHTEST / settings.rtol)
    factor = factor if factor <= 0.1 else 10.0  # no room below: a looser run bounds the error too
    rtol = min(settings.rtol * factor, _LOOSEST)
    size = max(_size(first.q - first.q[:1]), _size(first.u))
    atol = min(settings.atol * rtol / settings.rtol, max(_LOOSEST * size, _DUST))
    bounds = [settings.max_step / 2, _ELSEWHERE * (first.statistics.largest_step or 0.0)]
    if first.statistics.steps <= 2 * len(pieces):  # breaks and the end, not errors, set the steps
        bounds.append(_typical(pieces, pieces) / 2)
    longest = min((bound for bound in bounds if bound > 0.0), default=0.0)
    second = replace(
        settings, rtol=rtol, atol=atol, output_times=times, max_step=longest,
        max_steps=6 * settings.max_steps,
        first_step=0.3 * (first.statistics.smallest_step or 0.0),  # else both begin alike
    )  # fmt: skip
    return second, f"rtol {second.rtol:.0e}"


def _pieces(settings: Settings, breaks: Sequence[float]) -> Array:
    """(m,) lengths in s of what breaks cut the run into, ascending."""
    start, end = settings.t_start, settings.t_end
    stops = [start, *(b for b in breaks if start < b < end), end]
    return np.sort(np.diff(stops))


def _typical(sizes: Array, pieces: Array) -> float:
    """The entry of `sizes` (m,), ascending, below which hardly any of the run lies."""
    covered = np.cumsum(pieces)
    return float(sizes[np.searchsorted(covered, _MINOR * covered[-1])])


def _size(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def made_same_steps(first: Trajectory, second: Trajectory) -> bool:
    """True if a second run made the very steps of the first one, so that it says nothing of it."""
    a, b = first.statistics, second.statistics
    counts = (a.steps, a.rejected, a.evaluations, a.smallest_step, a.largest_step)
    return counts == (b.steps, b.rejected, b.evaluations, b.smallest_step, b.largest_step)


def compare(
    layout: Layout,
    first: Trajectory,
    second: Trajectory,
    reference: str,
    start: Array | None = None,
) -> ErrorEstimate:
    """Estimate from two runs; the second one sampled at the times of the first.

    `start` (nq,) is q at the start, from which one sample alone is seen to have moved.
    """
    t, ours, theirs = np.intersect1d(first.t, second.t, return_indices=True)
    q, u = (
        dict(_groups(layout, getattr(first, kind)[ours], getattr(second, kind)[theirs], kind))
        for kind in ("q", "u")
    )
    path = first.q if start is None or len(first.q) > 1 else np.vstack([start, first.q])
    moved = excursions(layout, path)
    horizon = _horizon(t, q, moved, first.settings.t_start)
    covered = None if second.is_comparable else float(t[-1])
    return ErrorEstimate(t, q, u, horizon, _tenfold(t, [*q.values()]), reference, moved, covered)


def _groups(layout: Layout, a: Array, b: Array, kind: str) -> Iterator[tuple[str, Array]]:
    """(unit, running maximum of SAFETY times the difference) for each unit."""
    found: dict[str, Array] = {}
    for unit, difference in differences(layout, a, b, kind):
        ahead = np.concatenate([difference, np.zeros(AHEAD)])
        near = np.lib.stride_tricks.sliding_window_view(ahead, AHEAD + 1).max(axis=1)
        error = np.maximum.accumulate(SAFETY * near)
        found[unit] = np.maximum(found.get(unit, error), error)
    yield from found.items()


def differences(
    layout: Layout, a: Array, b: Array, kind: str, but: str = ""
) -> Iterator[tuple[str, Array]]:
    """(unit, largest difference (n,) of any coordinate of it), rotations apart from other angles;
    none of the unit `but`."""
    for unit, places in (layout.q_by_unit if kind == "q" else layout.u_by_unit).items():
        if unit != but:
            yield unit, np.abs(a[:, places] - b[:, places]).max(axis=1)
    quaternions = layout.quaternions
    if kind == "q" and but != "rad" and len(quaternions):
        entries = quaternions[:, None] + np.arange(4)
        yield "rad", rotation_between(a[:, entries], b[:, entries]).max(axis=1)


def rotation_between(a: Array, b: Array) -> Array:
    """Angle (...) in rad between orientations given by unit quaternions (..., 4)."""
    apart, other = a - b, a + b
    chord = np.sqrt(np.minimum((apart * apart).sum(axis=-1), (other * other).sum(axis=-1)))
    return np.asarray(4.0 * np.arcsin(np.minimum(chord / 2.0, 1.0)))


def limit(moved: Mapping[str, float], unit: str, angle: float, part: float) -> float:
    """The error of coordinates of a unit that is bearable: an angle, or a part of how far they
    went; of what hardly moves, rounding."""
    return angle if unit == "rad" else max(part * moved.get(unit, 0.0), _DUST)


def excursions(layout: Layout, q: Array, but: str = "") -> dict[str, float]:
    """Unit, other than `but` -> largest excursion from the first sample of any coordinate of it."""
    found: dict[str, float] = {}
    for unit, difference in differences(layout, q, q[:1], "q", but):
        if len(difference):
            found[unit] = max(found.get(unit, 0.0), float(difference.max()))
    return found


def _horizon(t: Array, q: dict[str, Array], moved: dict[str, float], start: float) -> float | None:
    """The last sample before the runs differ by more than ANGLE or PART; without one the start."""
    limits = {unit: limit(moved, unit, ANGLE, PART) for unit in q}
    parted = [
        int(np.argmax(error > SAFETY * limits[unit]))
        for unit, error in q.items()
        if (error > SAFETY * limits[unit]).any()
    ]
    if not parted:
        return None
    return float(t[min(parted) - 1]) if min(parted) else start


def _tenfold(t: Array, errors: list[Array]) -> float | None:
    """Time for ten times the error, from a straight line through its logarithm over time."""
    if not errors or len(t) < 8:
        return None
    error = np.max(errors, axis=0)
    late = error >= max(_SMALLEST, 10 * error[len(t) // 10])
    late &= error < ANGLE
    if late.sum() < 5 or error[late][-1] < _GROWTH * error[late][0] / 10:
        return None
    slope, offset = np.polyfit(t[late], np.log10(error[late]), 1)
    rest = np.log10(error[late]) - slope * t[late] - offset
    powers = np.polyfit(np.log(t[late]), np.log10(error[late]), 1)
    other = np.log10(error[late]) - np.polyval(powers, np.log(t[late]))
    return float(1 / slope) if slope > 0 and rest.std() < other.std() else None
