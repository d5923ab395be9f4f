"""Peaks of frequency responses between the requested frequencies."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from mstmm.array_validation import Array

from ..frequency_response import FrequencyResponse
from ..modes import Complex

#: Offsets of extra frequencies about each mode: relative to its frequency; relative to the product
#: of its frequency and damping ratio.
_BESIDE, _WITHIN = (0.0, 1e-4, 1e-3, 1e-2), (0.5, 1.0, 2.0)
#: Damping ratio below which a mode counts as undamped; relative distance at which it is evaluated.
_UNDAMPED, _NEAR = 1e-9, 1e-6
#: Ratio of responses at half the distance from a pole that indicates one: 2 with a pole, else 1.
_POLE = 1.5
#: Points of a bracket; number of refinements, down to 1e-7 of its width.
_POINTS, _ROUNDS = 7, 14


class Peaks(NamedTuple):
    """Peak `magnitude` (k,) and its `omega` (k,), rad/s, of the first k output-input pairs.

    Pairs are in row-major order.  The magnitude is infinite at an undamped resonance.
    """

    magnitude: Array
    omega: Array


def find_peaks(
    answer: Callable[[Array], FrequencyResponse],
    grid: FrequencyResponse,
    eigenvalues: Complex,
    count: int,
) -> Peaks:
    """Peaks of the first `count` output-input pairs within the frequency range of `grid`.

    `answer` evaluates the response at other omega, rad/s; the search is refined near the
    `eigenvalues`, 1/s.
    """
    low, high = float(grid.omega.min()), float(grid.omega.max())
    ratio = np.abs(eigenvalues.real) / np.maximum(np.abs(eigenvalues), np.finfo(float).tiny)
    centre = np.abs(eigenvalues.imag)
    held = (low < centre) & (centre < high)

    def magnitudes(omega: Array) -> Array:
        return answer(omega).magnitude.reshape(len(omega), -1)[:, :count]

    more = _frequencies_near_modes(centre[held], ratio[held], low, high)
    values = grid.magnitude.reshape(len(grid.omega), -1)[:, :count]
    peaks = _refine_peaks(magnitudes, grid.omega, values, more)
    for omega in centre[held & (ratio <= _UNDAMPED)]:
        near = magnitudes(omega * (1 + _NEAR * np.array([1.0, 2.0])))
        unbounded = near[0] > _POLE * near[1]
        peaks.magnitude[unbounded], peaks.omega[unbounded] = np.inf, omega
    return peaks


def _frequencies_near_modes(centre: Array, ratio: Array, low: float, high: float) -> Array:
    """Frequencies within (low, high), rad/s, at and about those of damped modes."""
    parts = [sign * x for sign in (1, -1) for x in _BESIDE]
    widths = [sign * x for sign in (1, -1) for x in _WITHIN]
    damped = ratio > _UNDAMPED
    near = centre[damped, None] * (1 + np.array(parts))
    within = centre[damped, None] * (1 + ratio[damped, None] * np.array(widths))
    every = np.unique(np.concatenate([near.ravel(), within.ravel()]))
    return every[(every > low) & (every < high)]


def _refine_peaks(
    magnitudes: Callable[[Array], Array], omega: Array, values: Array, more: Array
) -> Peaks:
    """Peaks of `values` (m, k) at omega (m,) and of the responses at `more` frequencies.

    Each peak is refined within the bracket of its neighbours.
    """
    if len(more):
        omega, values = np.append(omega, more), np.concatenate([values, magnitudes(more)])
    order = np.argsort(omega)
    omega, values = omega[order], values[order]
    best, last = values.argmax(axis=0), len(omega) - 1
    peak, at = values.max(axis=0), omega[best]
    low, high = omega[np.maximum(best - 1, 0)], omega[np.minimum(best + 1, last)]
    pairs = np.arange(len(best))
    for _ in range(_ROUNDS if len(best) else 0):
        points = np.linspace(low, high, _POINTS)
        seen = magnitudes(points.ravel()).reshape(*points.shape, -1)[:, pairs, pairs]
        which = seen.argmax(axis=0)
        better = seen[which, pairs] > peak
        at = np.where(better, points[which, pairs], at)
        peak, step = np.maximum(peak, seen[which, pairs]), (high - low) / (_POINTS - 1)
        low, high = np.maximum(low, at - step), np.minimum(high, at + step)
    return Peaks(peak, at)
