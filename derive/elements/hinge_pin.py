"""Pin hinge: one rotation about the hinge axis (z)."""

import sympy as sp

from ..definition.element import Hinge, Param, Symbols, rotation_about


class Pin(Hinge):
    """Rotation about z of the hinge frame."""

    name = "pin"
    title = "pin hinge"
    motion_text = "rotation about one axis"
    coordinates = (Param("angle", "rad", "rotation about the hinge axis"),)
    sources = ("Rui, Wang, Zhang, ch. 5, (5.50)-(5.54)",)

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        return rotation_about(2, q.angle)
