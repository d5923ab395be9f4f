"""Ball hinge: free rotation, coordinates a unit quaternion, speeds in outboard axes."""

import sympy as sp

from ..definition.element import Hinge, Param, Symbols
from ..definition.notation import rate_of, rotation_of


class Ball(Hinge):
    """Speeds are the relative angular velocity in outboard axes; no singular orientation."""

    name = "ball"
    title = "ball hinge"
    motion_text = "free rotation"
    frame_rule = "own"
    coordinates = tuple(Param(n, "", "unit quaternion, outboard to inboard") for n in "wxyz")
    speeds = tuple(Param(f"w{n}", "rad/s", "angular velocity, outboard axes") for n in "xyz")
    sources = ("Rui, Wang, Zhang, ch. 5, (5.39)-(5.43)",)

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return rotation_of(*q)

    def coordinate_rates(self, q: Symbols, u: Symbols, p: Symbols) -> sp.Matrix:
        return rate_of(sp.Matrix(list(q)), sp.Matrix(list(u)))
