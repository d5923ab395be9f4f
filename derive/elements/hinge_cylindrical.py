"""Cylindrical hinge: translation along and rotation about the hinge axis (z)."""

import sympy as sp

from ..definition.element import Hinge, Param, Symbols, rotation_about


class Cylindrical(Hinge):
    """Translation and rotation along z of the hinge frame, independent of each other."""

    name = "cylindrical"
    title = "cylindrical hinge"
    motion_text = "rotation and translation along one axis"
    coordinates = (
        Param("displacement", "m", "translation along the hinge axis"),
        Param("angle", "rad", "rotation about the hinge axis"),
    )

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return rotation_about(2, q.angle)

    def position(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return sp.Matrix([0, 0, q.displacement])
