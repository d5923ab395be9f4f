"""Error estimate of a run from a second, more accurate run.

The second run has a hundredth of the tolerance (or half the fixed step).  The difference of the
two runs is the error of the first, up to the much smaller error of the second.  The estimate is
SAFETY times the largest difference so far, because the difference alone vanishes where the runs
happen to cross.  It is valid up to the predictability horizon: past that time the runs have
diverged, and neither of them predicts the motion.

The second run must take other steps, or it repeats the error of the first: where breaks and the end
cut the steps of the first run, those of the second are shorter than the pieces.  Where the
tolerance of the first run is too loose to bound anything, that of the second does not follow it.
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

#: The estimate at a sample includes this many later samples, because the runs may cross at one.
AHEAD = 3

#: Tolerance of the second run relative to the first.  With a tenth its error is not always smaller:
#: over 800 estimates of random scenes the ratio to the true error was 0.5 to 38 with a tenth, 1.2
#: to 5.2 with a hundredth.
TIGHTER = 0.01

#: Difference of angles (rad) from which two runs no longer predict the same motion.
ANGLE = 0.01

#: The same for other coordinates, relative to their largest excursion.
PART = 0.01

#: Longest step of the second run relative to the first: an incommensurate ratio, so that long steps
#: of the two runs sample different states and times.
_MAX_STEP_RATIO = 0.37

#: Smallest tolerance of a second run.
_MIN_TOLERANCE = 1e-14

#: Largest rtol of the second run; also its largest atol relative to the size of the motion.
_MAX_TOLERANCE = 1e-4

#: Motions and errors below this are rounding.
_ROUNDING = 1e-12

#: Minimum number of steps of the second run with a fixed step.
_MIN_FIXED_STEPS = 64

#: The shortest pieces between breaks that together cover less than this part of the run are not
#: halved.
_NEGLIGIBLE_SHARE = 0.01

#: Growth of the error that counts as exponential, and the smallest error above rounding.
_EXPONENTIAL_GROWTH, _MIN_ERROR = 1e3, 1e-15


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated error of a run: largest so far, per unit.

    Attributes:
        t: (n,) s, sample times that both runs reached.
        q: unit -> (n,) largest error of any coordinate of that unit up to t; the rotation error of
            a quaternion counts as rad.
        u: unit -> (n,) the same for speeds.
        divergence_time: s; predictability horizon, past which the runs differ too much; None
            without.
        tenfold_time: s in which errors grow tenfold, None if they do not grow exponentially.
        reference: description of the second run.
        excursion: unit -> largest excursion of coordinates of that unit, the scale of their errors.
        covered: s; end of the second run where it failed before the end of the first, so that the
            error beyond is unknown; None for the whole run.
    """

    t: Array
    q: dict[str, Array]
    u: dict[str, Array]
    divergence_time: float | None
    tenfold_time: float | None
    reference: str
    excursion: dict[str, float] = field(default_factory=dict)
    covered: float | None = None

    @property
    def diverges_at_start(self) -> bool:
        """True if the horizon is not after the first sample."""
        return self.divergence_time is not None and self.divergence_time <= self.t[0]

    def difference(self, kind: str = "q") -> dict[str, float]:
        """Unit -> largest error of q or u over all common samples, also past the horizon."""
        values: dict[str, Array] = getattr(self, kind)
        return {unit: float(v.max(initial=0.0)) for unit, v in values.items()}

    def largest(self, kind: str = "q") -> dict[str, float]:
        """Unit -> largest error of q or u up to the horizon, or over all common samples."""
        within = self.t < np.inf if self.divergence_time is None else self.t <= self.divergence_time
        values: dict[str, Array] = getattr(self, kind)
        return {unit: float(v[within].max(initial=0.0)) for unit, v in values.items()}


def reference_settings(first: Trajectory, breaks: Sequence[float] = ()) -> tuple[Settings, str]:
    """Settings of the second run, sampled at the times of the first, and their description.

    `breaks` are the times in s at which the scene ends every step.
    """
    settings, times = first.settings, tuple(np.unique(first.t).tolist())
    pieces = _pieces(settings, breaks)
    if settings.step is not None:
        half = settings.step / 2
        typical = _typical_length(np.minimum(pieces, settings.step), pieces)
        max_step = min(typical / 2, pieces.sum() / _MIN_FIXED_STEPS)
        step = min(half, max_step) if max_step > 0 else half
        name = "half the step" if step == half else "a shorter step"
        return replace(settings, step=step, output_times=times), f"{name}, {step:.6g} s"
    factor = max(TIGHTER, _MIN_TOLERANCE / settings.rtol)
    # If rtol cannot be tightened enough, a looser run bounds the error as well.
    factor = factor if factor <= 0.1 else 10.0
    rtol = min(settings.rtol * factor, _MAX_TOLERANCE)
    size = max(_max_abs(first.q - first.q[:1]), _max_abs(first.u))
    atol = min(settings.atol * rtol / settings.rtol, max(_MAX_TOLERANCE * size, _ROUNDING))
    bounds = [settings.max_step / 2, _MAX_STEP_RATIO * (first.statistics.largest_step or 0.0)]
    if first.statistics.steps <= 2 * len(pieces):  # breaks and the end, not errors, set the steps
        bounds.append(_typical_length(pieces, pieces) / 2)
    max_step = min((bound for bound in bounds if bound > 0.0), default=0.0)
    second = replace(
        settings, rtol=rtol, atol=atol, output_times=times, max_step=max_step,
        max_steps=6 * settings.max_steps,
        first_step=0.3 * (first.statistics.smallest_step or 0.0),  # another start than the first
    )  # fmt: skip
    return second, f"rtol {second.rtol:.0e}"


def _pieces(settings: Settings, breaks: Sequence[float]) -> Array:
    """Lengths (m,) in s of the pieces of a run between breaks, ascending."""
    start, end = settings.t_start, settings.t_end
    stops = [start, *(b for b in breaks if start < b < end), end]
    return np.sort(np.diff(stops))


def _typical_length(lengths: Array, pieces: Array) -> float:
    """Entry of `lengths` (m,), ascending, below which only a negligible share of the run lies."""
    covered = np.cumsum(pieces)
    return float(lengths[np.searchsorted(covered, _NEGLIGIBLE_SHARE * covered[-1])])


def _max_abs(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def made_same_steps(first: Trajectory, second: Trajectory) -> bool:
    """True if two runs made the same steps, so that their difference is no error estimate."""
    a, b = first.statistics, second.statistics
    counts = (a.steps, a.rejected_steps, a.evaluations, a.smallest_step, a.largest_step)
    return counts == (b.steps, b.rejected_steps, b.evaluations, b.smallest_step, b.largest_step)


def compare(
    layout: Layout,
    first: Trajectory,
    second: Trajectory,
    reference: str,
    start: Array | None = None,
) -> ErrorEstimate:
    """Error estimate from two runs; the second is sampled at the times of the first.

    `start` (nq,) is q at the start, needed for the excursion if the first run has one sample only.
    """
    t, rows_1, rows_2 = np.intersect1d(first.t, second.t, return_indices=True)
    q, u = (
        _running_errors(layout, getattr(first, kind)[rows_1], getattr(second, kind)[rows_2], kind)
        for kind in ("q", "u")
    )
    path = first.q if start is None or len(first.q) > 1 else np.vstack([start, first.q])
    moved = excursions(layout, path)
    horizon = _horizon(t, q, moved, first.settings.t_start)
    covered = None if second.is_comparable else float(t[-1])
    tenfold = _tenfold_time(t, [*q.values()])
    return ErrorEstimate(t, q, u, horizon, tenfold, reference, moved, covered)


def _running_errors(layout: Layout, a: Array, b: Array, kind: str) -> dict[str, Array]:
    """Unit -> running maximum (n,) of SAFETY times the difference of two runs."""
    errors: dict[str, Array] = {}
    for unit, difference in differences(layout, a, b, kind):
        padded = np.concatenate([difference, np.zeros(AHEAD)])
        window_max = np.lib.stride_tricks.sliding_window_view(padded, AHEAD + 1).max(axis=1)
        error = np.maximum.accumulate(SAFETY * window_max)
        errors[unit] = np.maximum(errors.get(unit, error), error)
    return errors


def differences(
    layout: Layout, a: Array, b: Array, kind: str, but: str = ""
) -> Iterator[tuple[str, Array]]:
    """Pairs of unit and largest difference (n,) of its coordinates, without the unit `but`.

    The rotation between quaternions is a further pair of unit rad.
    """
    for unit, indices in (layout.q_by_unit if kind == "q" else layout.u_by_unit).items():
        if unit != but:
            yield unit, np.abs(a[:, indices] - b[:, indices]).max(axis=1)
    quaternions = layout.quaternions
    if kind == "q" and but != "rad" and len(quaternions):
        entries = quaternions[:, None] + np.arange(4)
        yield "rad", rotation_between(a[:, entries], b[:, entries]).max(axis=1)


def rotation_between(a: Array, b: Array) -> Array:
    """Angle (...) in rad between orientations given by unit quaternions (..., 4)."""
    difference, total = a - b, a + b  # q and -q are the same orientation
    chord = np.sqrt(
        np.minimum((difference * difference).sum(axis=-1), (total * total).sum(axis=-1))
    )
    return np.asarray(4.0 * np.arcsin(np.minimum(chord / 2.0, 1.0)))


def error_limit(moved: Mapping[str, float], unit: str, angle: float, part: float) -> float:
    """Acceptable error of coordinates of a unit.

    `angle` (rad) for angles, else `part` of the excursion `moved`, at least rounding.
    """
    return angle if unit == "rad" else max(part * moved.get(unit, 0.0), _ROUNDING)


def excursions(layout: Layout, q: Array, but: str = "") -> dict[str, float]:
    """Unit -> largest excursion from the first sample of its coordinates; not of the unit `but`."""
    largest: dict[str, float] = {}
    for unit, difference in differences(layout, q, q[:1], "q", but):
        if len(difference):
            largest[unit] = max(largest.get(unit, 0.0), float(difference.max()))
    return largest


def _horizon(t: Array, q: dict[str, Array], moved: dict[str, float], start: float) -> float | None:
    """Last sample before the runs differ by more than ANGLE or PART, `start` if the first does."""
    limits = {unit: error_limit(moved, unit, ANGLE, PART) for unit in q}
    above = [error > SAFETY * limits[unit] for unit, error in q.items()]
    first_above = [int(np.argmax(is_above)) for is_above in above if is_above.any()]
    if not first_above:
        return None
    return float(t[min(first_above) - 1]) if min(first_above) else start


def _tenfold_time(t: Array, errors: list[Array]) -> float | None:
    """Time in s for tenfold growth of the error; None if a power law fits better."""
    if not errors or len(t) < 8:
        return None
    error = np.max(errors, axis=0)
    grows = error >= max(_MIN_ERROR, 10 * error[len(t) // 10])
    grows &= error < ANGLE
    if grows.sum() < 5 or error[grows][-1] < _EXPONENTIAL_GROWTH * error[grows][0] / 10:
        return None
    log_error = np.log10(error[grows])
    slope, offset = np.polyfit(t[grows], log_error, 1)
    exponential_residual = log_error - slope * t[grows] - offset
    power_law = np.polyfit(np.log(t[grows]), log_error, 1)
    power_residual = log_error - np.polyval(power_law, np.log(t[grows]))
    is_exponential = slope > 0 and exponential_residual.std() < power_residual.std()
    return float(1 / slope) if is_exponential else None
