"""Planar hinge: two translations in the plane normal to z, rotation about z."""

import sympy as sp

from ..definition.element import Hinge, Param, Symbols, rotation_about


class Planar(Hinge):
    """x and y along the inboard hinge axes, angle about their normal."""

    name = "planar"
    title = "planar hinge"
    motion_text = "translation in a plane and rotation about its normal"
    frame_rule = "plane"
    scene_keys = ("axis", "axis2")
    coordinates = (
        Param("x", "m", "translation along the in-plane axis"),
        Param("y", "m", "translation along normal x in-plane axis"),
        Param("angle", "rad", "rotation about the normal"),
    )

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return rotation_about(2, q.angle)

    def position(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return sp.Matrix([q.x, q.y, 0])
