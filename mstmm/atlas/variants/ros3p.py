"""Rosenbrock method that is A-stable but not L-stable.

J. Lang, J. Verwer, ROS3P, an accurate third-order Rosenbrock solver designed for parabolic
problems, BIT 41 (2001) 731-738: gamma = 1/2 + sqrt(3)/6.  Its spectral radius at infinity is
sqrt(3) - 1.
"""

from __future__ import annotations

import math

import numpy as np

from ...runtime.integrate.steppers.implicit_methods import Rosenbrock, make_rosenbrock

_ROOT = math.sqrt(3.0)
_GAMMA = 0.5 + _ROOT / 6


def tableau() -> Rosenbrock:
    """Tableau of the method, of order 3 with an error estimate of order 2."""
    inverse_gamma = 1 / _GAMMA
    A = [[0.0, 0, 0], [inverse_gamma, 0, 0], [inverse_gamma, 0, 0]]
    C = [[0.0, 0, 0], [-(inverse_gamma**2), 0, 0], [-2 * _ROOT, -_ROOT, 0]]
    last = _ROOT / 3, 1 - _ROOT / 3
    return make_rosenbrock(
        "ros3p", 3, _GAMMA, A, C, np.array([0.0, 1.0, 1.0]),
        np.array([_GAMMA, _GAMMA - 1, 0.5 - 2 * _GAMMA]), B=[2.0, *last],
        E=[2 - 5 / 3 * inverse_gamma, last[0] - 1, 0.0], error_order=2,
        source="Lang, Verwer, BIT 41 (2001)",
    )  # fmt: skip
