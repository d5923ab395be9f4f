"""Gimbal hinge: three angles (space-three 1-2-3), for comparison with the ball hinge."""

import sympy as sp

from ..definition.element import Hinge, Param, Symbols, rotation_about


class Gimbal(Hinge):
    """R = Rz(angle3) Ry(angle2) Rx(angle1); singular where cos(angle2) = 0."""

    name = "gimbal"
    title = "gimbal hinge (three angles)"
    motion_text = "three angles, R = Rz(angle3) Ry(angle2) Rx(angle1)"
    frame_rule = "own"
    scene_keys = ()
    coordinates = (
        Param("angle1", "rad", "rotation about x"),
        Param("angle2", "rad", "rotation about y"),
        Param("angle3", "rad", "rotation about z"),
    )

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return (
            rotation_about(2, q.angle3) * rotation_about(1, q.angle2) * rotation_about(0, q.angle1)
        )

    def singularity_measure(self, q: Symbols, p: Symbols) -> sp.Expr:
        return sp.cos(q.angle2)
