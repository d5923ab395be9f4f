"""Synonyms of hinge types in other programs."""

from __future__ import annotations

import re

_HINGE_TYPES_BY_SYNONYM = {
    "revolute": "pin", "continuous": "pin", "hinge": "pin", "pivot": "pin", "rotational": "pin",
    "slider": "prismatic", "slide": "prismatic", "translational": "prismatic",
    "spherical": "ball", "socket": "ball", "ballandsocket": "ball",
    "weld": "fixed", "rigid": "fixed", "clamp": "fixed", "clamped": "fixed",
    "floating": "free", "freejoint": "free", "freeflyer": "free",
    "cardan": "universal", "hooke": "universal", "helical": "screw", "bushing": "elastic",
}  # fmt: skip


def hinge_type_for(word: str) -> str | None:
    """Hinge type for a synonym used by other programs; None for an unknown one."""
    normalised = re.sub("[^a-z]", "", word.lower())
    return _HINGE_TYPES_BY_SYNONYM.get(normalised) or _HINGE_TYPES_BY_SYNONYM.get(
        re.sub("(joint|hinge)$", "", normalised)
    )
