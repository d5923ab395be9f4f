"""A knee: a flat plate rolls and slides on an elliptic profile."""

import sympy as sp

from mstmm.derive import Hinge, Param, rotation_about


class Knee(Hinge):
    """One coordinate; the motion subspace changes along the profile."""

    name = "knee"
    title = "knee, rolling with sliding"
    coordinates = (Param("contact", "rad", "place of the contact on the profile"),)
    parameters = (
        Param("width", "m", "half axis of the profile along x", minimum=0.001),
        Param("depth", "m", "half axis of the profile along y", minimum=0.001),
        Param("slip", "", "share of the path that slides", default=0.25, minimum=0, maximum=1),
    )

    def rotation(self, q, p):
        s = q.contact
        return rotation_about(2, sp.atan2(p.depth * sp.sin(s), p.width * sp.cos(s)))

    def position(self, q, p):
        s = q.contact
        profile = sp.Matrix([p.width * sp.sin(s), -p.depth * sp.cos(s), 0])
        rolled = (1 - p.slip) * (p.width + p.depth) / 2 * s
        return profile - rolled * self.rotation(q, p)[:, 0]
