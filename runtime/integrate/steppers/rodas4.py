"""Stiffly accurate 4(3) pair of Hairer and Wanner with six stages.

E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), section VI.4, code RODAS.

Coefficients as in the tables of OrdinaryDiffEqRosenbrock.jl, in the form without products by the
Jacobian.
"""

from __future__ import annotations

from .implicit_methods import Rosenbrock, make_rosenbrock_pair

_MATRIX = """
    1.544
    0.9466785280815826 0.2557011698983284
    3.314825187068521 2.896124015972201 0.9986419139977817
    1.221224509226641 6.019134481288629 12.53708332932087 -0.687886036105895
    1.221224509226641 6.019134481288629 12.53708332932087 -0.687886036105895 1
"""
_COUPLING = """
    -5.6688
    -2.430093356833875 -0.2063599157091915
    -0.1073529058151375 -9.594562251023355 -20.47028614809616
    7.496443313967647 -10.24680431464352 -33.99990352819905 11.7089089320616
    8.083246795921522 -7.981132988064893 -31.52159432874371 16.31930543123136 -6.058818238834054
"""
_NODES = """
    0 0.386 0.21 0.63 1 1
"""
_TIME = """
    0.25 -0.1043 0.1035 -0.0362 0 0
"""
_DENSE = """
    10.12623508344586 -7.487995877610167 -34.80091861555747 -7.992771707568823 1.025137723295662 0
    -0.6762803392801253 6.087714651680015 16.43084320892478 24.76722511418386 -6.594389125716872 0
"""


def tableau() -> Rosenbrock:
    """The method `rodas4`."""
    return make_rosenbrock_pair(
        "rodas4", 4, 0.25, _MATRIX, _COUPLING, _NODES, _TIME,
        _DENSE, 3, "Hairer and Wanner (1996), RODAS",
    )  # fmt: skip
