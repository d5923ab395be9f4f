"""Codes of reasons why an engine cannot evaluate a state; C reads them from `failures.h`."""

from __future__ import annotations

from enum import IntEnum


class FailureCode(IntEnum):
    """Reason of a `mstmm_failure`; `MSTMM_FAILED_<name>` in C."""

    UNDETERMINED = 1
    """No positive inertia opposes a motion of a hinge."""
    FORCE = 2
    """The direction of a spring is undefined."""
    EXPRESSION = 3
    """An expression of the scene has no value."""
    HINGE = 4
    """A guard in the definition of a hinge is violated."""
    PRODUCT_PIVOT = 5
    """The classical matrix of a hinge does not exist."""
    PRODUCT_ERROR = 6
    """The product of transfer matrices is not accurate enough."""
    SECTION = 7
    """A section of a flexible body rotates too far."""
    MODES = 8
    """The modal mass matrix of a flexible body is not positive definite."""
    TANGENT = 9
    """The tangent matrix of a step is singular in a motion."""
    CONTROLLER = 10
    """An input or output of a controller is not finite."""
    LOOP = 11
    """A loop cannot be closed near a state; the element is the frame of its cut hinge."""
    BOUNCE = 12
    """No motion can respond to the impact of an event."""
    COUPLING = 13
    """A coupling cannot be satisfied near a state; the element is its index."""
    FLAT = 14
    """A rolling disc is parallel to its plane."""
