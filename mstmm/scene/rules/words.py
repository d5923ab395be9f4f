"""Synonyms of hinge types in other programs."""

from __future__ import annotations

import re

_CALLED = {
    "revolute": "pin", "continuous": "pin", "hinge": "pin", "pivot": "pin", "rotational": "pin",
    "slider": "prismatic", "slide": "prismatic", "translational": "prismatic",
    "spherical": "ball", "socket": "ball", "ballandsocket": "ball",
    "weld": "fixed", "rigid": "fixed", "clamp": "fixed", "clamped": "fixed",
    "floating": "free", "freejoint": "free", "freeflyer": "free",
    "cardan": "universal", "hooke": "universal", "helical": "screw", "bushing": "elastic",
}  # fmt: skip


def ours(word: str) -> str | None:
    """Hinge type for a synonym used by other programs; None for an unknown one."""
    plain = re.sub("[^a-z]", "", word.lower())
    return _CALLED.get(plain) or _CALLED.get(re.sub("(joint|hinge)$", "", plain))
