"""Bending shapes of higher and higher number, by hyperbolic functions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ....array_validation import Array
from ....runtime.flexible.beam.gauss_quadrature import gauss_points
from ....runtime.flexible.beam.shape_functions import Eigenfunction
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import COUNT_SCALE
from ...variants import textbook_shapes


def _stable_shape(number: int, xi: Array) -> Array:
    return Eigenfunction("clamped-free", number, 0.0, 1.0)(xi)


def _error(number: float, shape: Callable[[int, Array], Array]) -> float:
    """Error of the integral of the squared shape over the length, which is scaled to 1."""
    xi, weights = gauss_points((0.0, 1.0), lambda a, b: number + 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        return abs(float(weights @ shape(int(number), xi) ** 2) - 1)


CASE = CaseDefinition(
    name="mode-shapes",
    title="Mode shapes by hyperbolic functions: their number",
    cause="In the printed form with cosh and sinh a shape is the difference of two numbers that "
    "grow by a factor of 23 per half-wave. At the end of about the eleventh shape no digit of it "
    "is left. The same shape written with exponentials that decay from both ends keeps all digits.",
    parameter="number of the shape",
    unit="",
    low=1,
    high=60,
    scale=COUNT_SCALE,
    measured="error of the shape's square over the length",
    limit=1e-4,
    method=MethodDefinition(
        "cosh and sinh", lambda n: _error(n, textbook_shapes.clamped_free_shape)
    ),
    remedy=MethodDefinition("decaying exponentials", lambda n: _error(n, _stable_shape)),
    reach=1000,
    source="Rao, Vibration of Continuous Systems, 2019, ch. 11; high numbers: Goncalves, "
    "Brennan, Elliott, Journal of Sound and Vibration 301, 2007",
)
