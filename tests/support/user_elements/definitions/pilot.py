"""Three angles of an aircraft with the rates that its pilot feels: qdot = N(q) u."""

import sympy as sp

from mstmm.derive import Hinge, Param, rotation_about


class Pilot(Hinge):
    """Yaw, pitch and roll; speeds are the angular velocity in body axes."""

    name = "pilot"
    coordinates = (Param("yaw", "rad"), Param("pitch", "rad"), Param("roll", "rad"))
    speeds = (Param("wx", "rad/s"), Param("wy", "rad/s"), Param("wz", "rad/s"))

    def rotation(self, q, p):
        turns = rotation_about(2, q.yaw), rotation_about(1, q.pitch), rotation_about(0, q.roll)
        return turns[0] * turns[1] * turns[2]

    def coordinate_rates(self, q, u, p):
        across = sp.sin(q.roll) * u.wy + sp.cos(q.roll) * u.wz
        return sp.Matrix(
            [
                across / sp.cos(q.pitch),
                sp.cos(q.roll) * u.wy - sp.sin(q.roll) * u.wz,
                u.wx + sp.tan(q.pitch) * across,
            ]
        )

    def motion_subspace(self, q, p):
        return sp.Matrix.vstack(sp.zeros(3, 3), sp.eye(3))

    def singularity_measure(self, q, p):
        return sp.cos(q.pitch)
