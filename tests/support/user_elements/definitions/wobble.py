"""A thread whose pitch and plane change along its turn: two coupled coordinates."""

import sympy as sp

from mstmm.derive import Hinge, Param, rotation_about


class Wobble(Hinge):
    """Turn about z, and a tilt that wobbles with the turn and changes the pitch."""

    name = "wobble"
    coordinates = (Param("turn", "rad"), Param("tilt", "rad"))
    parameters = (Param("radius", "m", minimum=0), Param("pitch", "m/rad"))

    def rotation(self, q, p):
        return rotation_about(2, q.turn) * rotation_about(0, q.tilt + sp.sin(q.turn) / 4)

    def position(self, q, p):
        climb = p.pitch * q.turn * sp.cos(q.tilt)
        return sp.Matrix([p.radius * sp.cos(q.turn), p.radius * sp.sin(q.turn), climb])
