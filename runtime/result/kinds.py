"""What a vector quantity is called and measured in."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Kind:
    """A vector quantity of a body or hinge: unit, long name, columns, short names of those."""

    unit: str
    long_name: str
    labels: tuple[str, ...]
    short: tuple[str, ...]
