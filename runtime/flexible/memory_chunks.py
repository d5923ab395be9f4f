"""Arrays of all pairs of shapes are handled in parts: of many shapes they fill gigabytes."""

from __future__ import annotations

#: Numbers of one array that are handled together, 8 MB.
_TOGETHER = 2**20


def slices(count: int, each: int) -> list[slice]:
    """0 to `count` in parts of so many entries of `each` numbers as are handled together."""
    step = max(1, _TOGETHER // max(1, each))
    return [slice(first, min(first + step, count)) for first in range(0, count, step)]
