"""How steps of the classical method fail, in words."""

from __future__ import annotations

from typing import Any


def words(lib: Any, failure: int, hinge: str, body: str) -> tuple[str, str]:
    """What happened and one way out; `hinge` and `body` are those of the failing element."""
    return {
        lib.MSTMM_CLASSICAL_SINGULAR: (
            f"{hinge}: its motion is undetermined", "give what it carries mass and inertia",
        ),
        lib.MSTMM_CLASSICAL_LOST: (
            f"the product of transfer matrices has lost its digits: loads are left at the free "
            f"end of {body} (errors grow geometrically along a chain)",
            "use method dttmm-classical",
        ),
        lib.MSTMM_CLASSICAL_OPEN: (
            f"{hinge} has come open: loads of constraints at position level oscillate and grow "
            "under an undamped scheme or a long step",
            "use generalised-alpha or a shorter step",
        ),
        lib.MSTMM_CLASSICAL_UNSETTLED: (
            "the iterations of a step do not converge", "use a shorter step"
        ),
        lib.MSTMM_CLASSICAL_FAR: (
            f"one linear solution moves {body} farther than the scene is large, because the "
            "steps leave a fast motion unresolved",
            "give iterations, a scheme that damps or a shorter step",
        ),
        lib.MSTMM_CLASSICAL_NOT_FINITE: (
            f"the motion of {body} is not finite", "use a shorter step or a scheme that damps"
        ),
    }[failure]  # fmt: skip
