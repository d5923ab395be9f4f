"""Exact results for flexible bodies."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def spinning_shaft(about_y: float, about_z: float, spin: float) -> Array:
    """Squares of the frequencies, in axes that turn with it, of one pair of bending modes of a
    shaft that spins about its own axis; `about_y`, `about_z` are its frequencies at rest, rad/s.

    y'' - 2 W z' + (a^2 - W^2) y = 0,  z'' + 2 W y' + (b^2 - W^2) z = 0: for a = b the roots are
    |a +- W|; for a < W < b one square is negative and the shaft unstable.
    """
    a, b, w = about_y**2, about_z**2, spin**2
    middle = (a + b) / 2 + w
    spread = np.sqrt(((a - b) / 2) ** 2 + 2 * w * (a + b))
    return np.array([middle - spread, middle + spread])


#: Smallest q = rho A g L^3 / EI with J_{-1/3}(2/3 sqrt(q)) = 0: a standing beam buckles under its
#: own weight (Greenhill 1881).
SELF_WEIGHT_BUCKLING = 7.837347438943

#: Frequencies of a heavy chain of length L: first zero of J0 over 2, times sqrt(g/L).
HEAVY_CHAIN = 2.404825557695773 / 2


def steady_stretch(mass: float, spin: float, length: float, stiffness: float) -> float:
    """Extension of a bar that turns about one end: rho A W^2 L^3 / (3 EA)."""
    return mass * spin**2 * length**3 / (3 * stiffness)
