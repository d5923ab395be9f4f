"""Messages for failed steps of the classical method."""

from __future__ import annotations

from typing import Any


def failure_message(lib: Any, failure: int, hinge: str, body: str) -> tuple[str, str]:
    """Message and remedy of a failure; `hinge` and `body` name the failing element."""
    return {
        lib.MSTMM_CLASSICAL_SINGULAR: (
            f"{hinge}: its motion is undetermined", "give the outboard bodies mass and inertia",
        ),
        lib.MSTMM_CLASSICAL_LOST: (
            f"the product of transfer matrices is lost to rounding: loads remain at the free end "
            f"of {body} (errors grow geometrically along a chain)",
            "use method dttmm-classical",
        ),
        lib.MSTMM_CLASSICAL_OPEN: (
            f"{hinge} has a position gap: constraint loads at position level oscillate and grow "
            "with an undamped scheme or a long step",
            "use generalised-alpha or a shorter step",
        ),
        lib.MSTMM_CLASSICAL_UNSETTLED: (
            "the iterations of a step do not converge", "use a shorter step"
        ),
        lib.MSTMM_CLASSICAL_FAR: (
            f"one linear solution moves {body} by more than the size of the scene, because the "
            "steps do not resolve a fast motion",
            "use iterations, a damped scheme or a shorter step",
        ),
        lib.MSTMM_CLASSICAL_NOT_FINITE: (
            f"the motion of {body} is not finite", "use a shorter step or a damped scheme"
        ),
    }[failure]  # fmt: skip
