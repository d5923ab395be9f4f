"""Screw hinge: rotation about and proportional translation along the hinge axis (z)."""

import sympy as sp

from ..definition.element import Hinge, Param, Symbols, rotation_about


class Screw(Hinge):
    """Translation of `lead` per turn along z of the hinge frame."""

    name = "screw"
    title = "screw hinge"
    motion_text = "rotation with translation along its axis"
    scene_keys = ("axis", "lead")
    coordinates = (Param("angle", "rad", "rotation about the hinge axis"),)
    parameters = (Param("lead", "m", "translation per turn"),)

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return rotation_about(2, q.angle)

    def position(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return sp.Matrix([0, 0, p.lead * q.angle / (2 * sp.pi)])
