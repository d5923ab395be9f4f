"""Amplitudes over frequency of a run's quantities."""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError

from ..names import Quantity
from .curves import between

#: Samples that a spectrum needs, and that one is made of at most.
_LEAST, _MOST = 16, 2**16

#: Frequencies lie this much closer than one over the run, so that a peak is found between them.
_CLOSER = 4


def spectrum(t: Array, quantity: Quantity) -> tuple[Array, Array]:
    """Frequencies (m,) in Hz and amplitudes (m, k) in the quantity's unit.

    A sine of amplitude a that lasts for many periods shows as a peak of height a: the mean is taken
    away, and the rest seen through Hann's window, whose own mean is divided out (SciPy's
    periodogram, scaling "spectrum").  Samples that are not evenly spaced are read off the curve
    through them at as many even times; frequencies end where these have two in a period.

    Raises SceneError for too few samples and for values that are not finite.
    """
    from scipy.signal import periodogram

    t, some = np.unique(t, return_index=True)
    values = quantity.values.reshape(len(quantity.values), -1)[some]
    if len(t) < _LEAST:
        raise SceneError(
            f'"{quantity.name}": a spectrum needs {_LEAST} samples or more, there are {len(t)}; '
            "ask for more output times"
        )
    if not np.isfinite(values).all():
        raise SceneError(f'"{quantity.name}": some values are not finite, so it has no spectrum')
    even = np.linspace(t[0], t[-1], min(len(t), _MOST))
    if not np.allclose(t, even, rtol=0, atol=1e-6 * (even[1] - even[0])):
        rates = (
            None if quantity.rates is None else quantity.rates().reshape(len(quantity.values), -1)
        )
        values = between(t, values, None if rates is None else rates[some], even)
    frequencies, powers = periodogram(
        values, 1 / (even[1] - even[0]), "hann", _CLOSER * len(even), "constant",
        scaling="spectrum", axis=0,
    )  # fmt: skip
    return frequencies, np.sqrt(2 * powers)
