"""Amplitude spectra of a run's quantities."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ..quantity_names import Quantity
from .curve_interpolation import interpolate

#: Least number of samples for a spectrum, and largest number used.
_MIN_SAMPLES, _MAX_SAMPLES = 16, 2**16

#: Factor of refinement relative to frequencies spaced by one over the run, to locate peaks.
_FREQUENCY_REFINEMENT = 4


def spectrum(t: Array, quantity: Quantity) -> tuple[Array, Array]:
    """Frequencies (m,) in Hz and amplitudes (m, k) in the quantity's unit.

    A sine of amplitude a that lasts for many periods appears as a peak of height a: the mean is
    subtracted, and Hann's window is applied and normalised by its own mean (SciPy's periodogram,
    scaling "spectrum"). Samples that are not evenly spaced are interpolated on the curve through
    them at the same number of even times; frequencies end at two samples per period.

    Raises SceneError for too few samples and for values that are not finite.
    """
    from scipy.signal import periodogram

    t, unique_indices = np.unique(t, return_index=True)
    values = quantity.values.reshape(len(quantity.values), -1)[unique_indices]
    if len(t) < _MIN_SAMPLES:
        raise SceneError(
            f'"{quantity.name}": a spectrum needs {_MIN_SAMPLES} samples or more, there are '
            f"{len(t)}; give more output times"
        )
    if not np.isfinite(values).all():
        raise SceneError(f'"{quantity.name}": some values are not finite, so it has no spectrum')
    even_times = np.linspace(t[0], t[-1], min(len(t), _MAX_SAMPLES))
    if not np.allclose(t, even_times, rtol=0, atol=1e-6 * (even_times[1] - even_times[0])):
        rates = (
            None if quantity.rates is None else quantity.rates().reshape(len(quantity.values), -1)
        )
        values = interpolate(
            t, values, None if rates is None else rates[unique_indices], even_times
        )
    frequencies, powers = periodogram(
        values,
        1 / (even_times[1] - even_times[0]),
        "hann",
        _FREQUENCY_REFINEMENT * len(even_times),
        "constant",
        scaling="spectrum",
        axis=0,
    )
    return frequencies, np.sqrt(2 * powers)
