"""Fixed hinge (weld): no relative motion."""

from ..definition.element import Hinge


class Fixed(Hinge):
    """No coordinates; both ends coincide."""

    name = "fixed"
    title = "fixed hinge"
    motion_text = "rigid connection"
    frame_rule = "own"
    scene_keys = ()
