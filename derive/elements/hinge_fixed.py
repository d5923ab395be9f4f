"""Fixed hinge (weld): no relative motion."""

from ..definition.element import Hinge


class Fixed(Hinge):
    """Both ends move as one."""

    name = "fixed"
    title = "fixed hinge"
    allows = "rigid connection"
    frame = "own"
    keys = ()
