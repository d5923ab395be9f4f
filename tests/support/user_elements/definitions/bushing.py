"""A rubber bushing: stiffer the further it is pressed."""

import sympy as sp

from mstmm.derive import ForceElement, Param


class Bushing(ForceElement):
    """V = k x^2/2 + c x^4/4, with a damper."""

    name = "bushing"
    parameters = (
        Param("stiffness", "N/m", minimum=0),
        Param("cubic", "N/m^3", default=0.0),
        Param("damping", "N*s/m", default=0.0, minimum=0),
    )

    def wrench(self, x, v, rotation, w, p, effort, t):
        return -(p.stiffness + p.cubic * x.dot(x)) * x - p.damping * v, sp.zeros(3, 1)

    def potential(self, x, p):
        return p.stiffness * x.dot(x) / 2 + p.cubic * x.dot(x) ** 2 / 4
