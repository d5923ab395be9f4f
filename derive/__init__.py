"""Derivation of C from symbols: definitions, checks, lowering, rendering.

The only package that uses SymPy.  Names that need SymPy are imported on first use, because printing
the fused code of a scene works without it.
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
