"""Elastic hinge: the free hinge, whose law is a spring and damper in six directions."""

from .hinge_free import Free


class Elastic(Free):
    """Moves as the free hinge does; the law of the scene holds it."""

    name = "elastic"
    title = "elastic hinge"
    allows = "spring and damper in six directions"
    runs_as = "free"
