"""Third-order Rosenbrock method with four stages that keeps its order with any tangent.

J. Rang, L. Angermann, New Rosenbrock W-methods of order 3 for partial differential algebraic
equations of index 1, BIT Numerical Mathematics 45 (2005) 761-787.

Coefficients as in the tables of OrdinaryDiffEqRosenbrock.jl, in the form without products by the
Jacobian.  Dense output is the cubic through both ends and their slopes.
"""

from __future__ import annotations

from .implicit_methods import Implicit, lower_triangle, make_rosenbrock, parse_numbers

_MATRIX = """
    2
    1.4192173174557647 -0.2592322116729697
    4.18476048231916 -0.28519201735549593 2.294280360279042
"""
_COUPLING = """
    -4.588560720558084
    -4.18476048231916 0.28519201735549593
    -6.368179200128359 -6.795620944466837 2.8700986043310563
"""
_NODES = "0 0.871733043016918 0.7315799577888524 1"
_TIME = "0.435866521508459 -0.435866521508459 -0.4133333762338865 0"
_STEP = "4.1847604823191595 -0.28519201735549565 2.2942803602790414 1"
_ERROR = "0.2777499476479681 -1.4032398951759992 1.7726301276675507 0.5"


def tableau() -> Implicit:
    """The method `ros34pw2`."""
    return make_rosenbrock(
        "ros34pw2",
        3,
        0.435866521508459,
        lower_triangle(_MATRIX, 4),
        lower_triangle(_COUPLING, 4),
        parse_numbers(_NODES),
        parse_numbers(_TIME),
        B=parse_numbers(_STEP),
        E=parse_numbers(_ERROR),
        error_order=2,
        dense_order=3,
        source="Rang and Angermann (2005), ROS34PW2",
    )
