"""4(3) pair of Steinebach with six stages that keeps order 3 with stiff prescribed motion.

G. Steinebach, Improvement of Rosenbrock-Wanner method RODASP, in: Progress in
Differential-Algebraic Equations II, Springer (2020) 165-184.

Coefficients as in the tables of OrdinaryDiffEqRosenbrock.jl, in the form without products by the
Jacobian.
"""

from __future__ import annotations

from .implicit_methods import Rosenbrock, make_rosenbrock_pair

_MATRIX = """
    3
    0.906377755268814 -0.189707390391685
    3.758617027739064 1.161741776019525 -0.849258085312803
    7.089566927282776 4.573591406461604 -8.423496976860259 -0.959280113459775
    7.089566927282776 4.573591406461604 -8.423496976860259 -0.959280113459775 1
"""
_COUPLING = """
    -12
    -6.354581592719008 0.338972550544623
    -8.575016317114033 -7.606483992117508 12.22499765012482
    -5.888975457523102 -8.157396617841821 24.805546872612922 12.790401512796979
    -4.408651676063871 -6.692003137674639 24.625568527593117 16.627521966636085 -5.714285714285718
"""
_NODES = """
    0 0.75 0.321448134013046 0.519745732277726 1 1
"""
_TIME = """
    0.25 -0.5 -0.189532918363016 0.085612108792769 0 0
"""
_DENSE = """
    -5.323528268423303 -10.042123754867493 17.175254928256965 -5.079931171878093
    -0.016185991706112 0 6.984505741529879 6.914061169603662 -0.849178943070653 18.104410789349338
    -3.516963011559032 0
"""


def tableau() -> Rosenbrock:
    """The method `rodas4p2`."""
    return make_rosenbrock_pair(
        "rodas4p2", 4, 0.25, _MATRIX, _COUPLING, _NODES, _TIME,
        _DENSE, 3, "Steinebach (2020), Rodas4P2",
    )  # fmt: skip
