"""Key of cached flexible bodies."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class CacheKey(Generic[T]):
    """Argument of a cached function: compared by `key`, which determines the relevant `value`."""

    key: Hashable
    value: T = field(compare=False)
