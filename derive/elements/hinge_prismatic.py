"""Prismatic hinge: one translation along the hinge axis (z)."""

import sympy as sp

from ..definition.element import Hinge, Param, Symbols


class Prismatic(Hinge):
    """Translation along z of the hinge frame."""

    name = "prismatic"
    title = "prismatic hinge"
    motion_text = "translation along one axis"
    coordinates = (Param("displacement", "m", "translation along the hinge axis"),)

    def position(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return sp.Matrix([0, 0, q.displacement])
