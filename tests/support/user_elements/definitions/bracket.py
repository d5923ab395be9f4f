"""A bracket and a raised pin: their ends do not lie where the scene's positions meet."""

import sympy as sp

from mstmm.derive import Hinge, Param, rotation_about


class Bracket(Hinge):
    """Holds the outboard end at a distance."""

    name = "bracket"
    parameters = (Param("reach", "m", "from Q to P along x"),)

    def position(self, q, p):
        return sp.Matrix([p.reach, 0, 0])


class RaisedPin(Hinge):
    """Turns about z, above the inboard end."""

    name = "raised_pin"
    coordinates = (Param("angle", "rad", "about z"),)
    parameters = (Param("height", "m", "from Q to P along z"),)

    def rotation(self, q, p):
        return rotation_about(2, q.angle)

    def position(self, q, p):
        return sp.Matrix([0, 0, p.height])
