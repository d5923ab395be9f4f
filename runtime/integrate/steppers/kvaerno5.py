"""5(4) pair of diagonally implicit stages, both results L-stable and stiffly accurate.

A. Kvaerno, Singly diagonally implicit Runge-Kutta methods with an explicit first stage, BIT
Numerical Mathematics 44 (2004) 489-502.
"""

from __future__ import annotations

import numpy as np

from .implicit_methods import Implicit, make_diagonal

_GAMMA = 0.26
_MATRIX = [
    [0.0],
    [_GAMMA, _GAMMA],
    [0.13, 0.84033320996790809, _GAMMA],
    [0.22371961478320505, 0.47675532319799699, -0.06470895363112615, _GAMMA],
    [0.16648564323248321, 0.1045001884159172, 0.03631482272098715, -0.13090704451073998, _GAMMA],
    [0.13855640231268224, 0.0, -0.04245337201752043, 0.02446657898003141, 0.61943039072480676,
     _GAMMA],
    [0.13659751177640291, 0.0, -0.05496908796538376, -0.04118626728321046, 0.62993304899016403,
     0.06962479448202728, _GAMMA],
]  # fmt: skip
_NODES = [0.0, 0.52, 1.230333209967908, 0.895765984350076, 0.436393609858648, 1.0, 1.0]


def tableau() -> Implicit:
    """The method `kvaerno5`."""
    embedded, step = np.array([*_MATRIX[5], 0.0]), np.array(_MATRIX[6])
    return make_diagonal(
        "kvaerno5", 5, _MATRIX, _NODES, step - embedded, error_order=4, source="Kvaerno (2004)"
    )
