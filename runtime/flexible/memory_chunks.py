"""Chunks of large arrays: arrays of all pairs of many shapes would fill gigabytes."""

from __future__ import annotations

#: Numbers per chunk, 8 MB.
_CHUNK_SIZE = 2**20


def chunk_slices(count: int, entry_size: int) -> list[slice]:
    """Slices from 0 to `count`, each of at most a chunk of entries of `entry_size` numbers."""
    step = max(1, _CHUNK_SIZE // max(1, entry_size))
    return [slice(first, min(first + step, count)) for first in range(0, count, step)]
