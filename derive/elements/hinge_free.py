"""Free hinge: six degrees of freedom; gives a body a free root."""

import sympy as sp

from ..definition.element import Hinge, Param, Symbols
from ..definition.notation import rate_of, rotation_of

COORDINATES = (
    *(Param(n, "m", "P from Q, inboard hinge axes") for n in "xyz"),
    *(Param(f"q{n}", "", "unit quaternion, outboard to inboard") for n in "wxyz"),
)
SPEEDS = (
    *(Param(f"v{n}", "m/s", "velocity of P relative to Q, outboard axes") for n in "xyz"),
    *(Param(f"w{n}", "rad/s", "angular velocity, outboard axes") for n in "xyz"),
)


class Free(Hinge):
    """Position in inboard hinge axes, orientation as a quaternion, speeds in outboard axes."""

    name = "free"
    title = "free hinge"
    motion_text = "six degrees of freedom"
    frame_rule = "own"
    coordinates = COORDINATES
    speeds = SPEEDS

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return rotation_of(*list(q)[3:])

    def position(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return sp.Matrix(list(q)[:3])

    def coordinate_rates(self, q: Symbols, u: Symbols, p: Symbols) -> sp.Matrix:
        velocity, spin = sp.Matrix(list(u)[:3]), sp.Matrix(list(u)[3:])
        orientation = sp.Matrix(list(q)[3:])
        return sp.Matrix.vstack(rotation_of(*orientation) * velocity, rate_of(orientation, spin))
