"""Universal hinge: rotations about two axes that intersect in the hinge point."""

import sympy as sp

from ..definition.element import Hinge, Param, Symbols, rotation_about


class Universal(Hinge):
    """Rotation about z of the inboard frame, then about z of the outboard frame.

    `alpha` is the angle between the axes; both frames share their x axis (normal to both axes)
    when the angles are zero.
    """

    name = "universal"
    title = "universal hinge"
    motion_text = "rotation about two axes in turn"
    frame_rule = "crossing"
    scene_keys = ("axis", "axis2")
    coordinates = (
        Param("angle1", "rad", "rotation about the first axis (fixed in the inboard body)"),
        Param("angle2", "rad", "rotation about the second axis (fixed in the outboard body)"),
    )
    parameters = (Param("alpha", "rad", "angle between the axes"),)

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        tilt = rotation_about(0, p.alpha)
        return rotation_about(2, q.angle1) * tilt * rotation_about(2, q.angle2)
