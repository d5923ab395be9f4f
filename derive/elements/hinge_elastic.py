"""Elastic hinge: the free hinge, whose law is a spring and damper in six directions."""

from .hinge_free import Free


class Elastic(Free):
    """Motion of the free hinge; the law of the scene adds spring and damper."""

    name = "elastic"
    title = "elastic hinge"
    motion_text = "spring and damper in six directions"
    equivalent_builtin = "free"
