"""Why the engines cannot evaluate a state, as numbers; C has them from `failures.h`."""

from __future__ import annotations

from enum import IntEnum


class Failed(IntEnum):
    """Reason of a `mstmm_failure`; `MSTMM_FAILED_<name>` in C."""

    UNDETERMINED = 1
    """What a hinge carries leaves no positive inertia to a motion of it."""
    FORCE = 2
    """The direction of a spring is undefined."""
    EXPRESSION = 3
    """An expression of the scene has no value."""
    HINGE = 4
    """The definition of a hinge fails."""
    PRODUCT_PIVOT = 5
    """The classical matrix of a hinge does not exist."""
    PRODUCT_ERROR = 6
    """The product of transfer matrices is not accurate enough."""
    SECTION = 7
    """A section of a flexible body turns too far."""
    MODES = 8
    """The modal mass matrix of a flexible body is not positive definite."""
    TANGENT = 9
    """The tangent of a step leaves a motion undetermined."""
    CONTROLLER = 10
    """A controller measures, or gives, what is not finite."""
    LOOP = 11
    """A loop cannot be closed near a state; the element is the frame of what closes it."""
    BOUNCE = 12
    """Nothing can give way to the strike of an event."""
    COUPLING = 13
    """A coupling cannot be met near a state; the element is its number."""
    FLAT = 14
    """A disc that rolls lies flat on its plane."""
