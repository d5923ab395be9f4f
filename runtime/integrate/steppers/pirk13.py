"""Iterated Gauss method of order 13 with eight nodes, for right-hand sides with SIMD lanes.

The eight stages of Gauss's implicit method are found by functional iteration from k_0.  Every
iteration raises the order by one, and its eight right-hand sides are independent of each other.  If
a compiled scene evaluates eight states in about the time of one, a step costs 13 successive
evaluations and is as long as order 13 permits.  Otherwise it costs 97, and dop853 is preferable.

P. J. van der Houwen, B. P. Sommeijer, Parallel iteration of high-order Runge-Kutta methods with
stepsize control, Journal of Computational and Applied Mathematics 29 (1990) 111-127.  Nodes: M.
Abramowitz, I. A. Stegun, Handbook of Mathematical Functions (1964), table 25.4.  The weights follow
from the nodes in exact arithmetic.  Dense output is the polynomial of degree 10 whose slope agrees
with the eight last stages and both ends; the stages are of order 8 each, so it is of order 9. (More
points and repeated evaluation of stages gave no better results at the steps of usual tolerances.)

The difference of two iterates measures the convergence of the iteration, but not the error due to
forces that depend on time alone: these have the same values in every iterate.  The error estimate
therefore also contains the ninth divided difference of the slopes at both ends and the eight nodes.
Its weight is negligible for smooth motion and large enough to detect a pole or a jump.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np

from mstmm.array_validation import Array

from .tableau import Tableau, divided_difference, from_monomials, integrals, to_read_only

_ITERATIONS = 12
_COMPARED_ITERATION = 9  # iterations of the result with which the error estimate compares

#: Weight of the divided difference in the error estimate.  For oscillating forces it exceeds the
#: error of Gauss's weights up to 20 rad per step; for smooth motion the iterates differ more.
_ROUGHNESS_WEIGHT = 1e-8

#: Positive zeros of the Legendre polynomial of degree 8.
_ZEROS = """
    0.183434642495649804939476142360 0.525532409916328985817739049189
    0.796666477413626739591553936476 0.960289856497536231683560868569
"""

Polynomial = list[Fraction]


def _nodes() -> list[Fraction]:
    zeros = [Fraction(word) for word in _ZEROS.split()]
    return sorted((1 + sign * zero) / 2 for zero in zeros for sign in (-1, 1))


def _value(polynomial: Polynomial, at: Fraction) -> float:
    return float(
        sum(coefficient * at ** (exponent + 1) for exponent, coefficient in enumerate(polynomial))
    )


def tableau() -> Tableau:
    """The method `pirk13`."""
    nodes = _nodes()
    n = len(nodes)
    slopes = integrals(nodes)
    weights = np.array([_value(p, Fraction(1)) for p in slopes])
    block = np.array([[_value(p, node) for p in slopes] for node in nodes])
    block_slices = [slice(1 + i * n, 1 + (i + 1) * n) for i in range(_ITERATIONS)]
    stages = 1 + n * _ITERATIONS
    c = np.array([0.0, *[float(node) for node in nodes] * _ITERATIONS])
    a, b, error = np.zeros((stages, stages)), np.zeros(stages), np.zeros(stages + 1)
    a[block_slices[0], 0] = c[block_slices[0]]
    for previous, following in pairwise(block_slices):
        a[following, previous] = block
    b[block_slices[-1]] = error[block_slices[-1]] = weights
    error[block_slices[_COMPARED_ITERATION - 1]] = -weights
    error[[0, *range(stages - n, stages + 1)]] += _ROUGHNESS_WEIGHT * np.array(
        divided_difference([Fraction(0), *nodes, Fraction(1)])
    )
    return Tableau(
        name="pirk13",
        order=_ITERATIONS + 1,
        A=to_read_only(a),
        B=to_read_only(b),
        C=to_read_only(c),
        dense=_dense(nodes, weights, stages),
        dense_order=n + 1,
        E=to_read_only(error),
        error_order=_COMPARED_ITERATION,
        iterated=(n, _ITERATIONS),
        source="van der Houwen and Sommeijer (1990), nodes of Gauss",
    )


def _dense(nodes: Sequence[Fraction], weights: Array, stages: int) -> Array:
    """Dense output whose slope interpolates k_0, the last eight stages and the next step's k_0."""
    points = [Fraction(0), *nodes, Fraction(1)]
    compact_weights = np.array(from_monomials(integrals(points)))
    compact_weights[:, 0] = [
        0.0,
        *weights,
        0.0,
    ]  # exact values; rounding of the nodes would change them
    dense_weights = np.zeros((stages + 1, compact_weights.shape[1]))
    dense_weights[0], dense_weights[stages - len(nodes) : stages], dense_weights[stages] = (
        compact_weights[0],
        compact_weights[1:-1],
        compact_weights[-1],
    )
    return to_read_only(dense_weights)
