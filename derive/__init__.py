"""Symbols to C text: derivations, checks, lowering, rendering.  The only room that knows SymPy.

What a definition of an element needs is imported when it is asked for: printing the fused code of a
scene needs no SymPy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .definition.element import Body, ForceElement, Hinge, Param, rotation_about

__all__ = ["Body", "ForceElement", "Hinge", "Param", "rotation_about"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .definition import element

    return getattr(element, name)


def __dir__() -> list[str]:
    return __all__
