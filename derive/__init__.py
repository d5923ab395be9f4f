"""Symbols to C text: derivations, checks, lowering, rendering.  The only room that knows SymPy."""

from .element import Body, ForceElement, Hinge, Param, rotation_about

__all__ = ["Body", "ForceElement", "Hinge", "Param", "rotation_about"]
