"""Packages that come with an extra, imported when they are needed."""

from __future__ import annotations

from .errors import EnvironmentFailure


def missing(name: str, what: str, error: ImportError) -> EnvironmentFailure:
    """A package of an extra is missing: which one, what for, and how to get it."""
    return EnvironmentFailure(
        f"{what} needs the package {error.name or 'of an extra'}, which is not installed; "
        f"install it with: pip install 'mstmm[{name}]'"
    )
