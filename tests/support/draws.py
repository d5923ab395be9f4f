"""Numbers of random draws: few in every run, the rest in a soak run."""

from __future__ import annotations

from typing import Any

import pytest


def draws(count: int, soak: int) -> list[Any]:
    """Parameters 0 ... `soak` - 1; those from `count` on run only with `-m soak`."""
    return [*range(count), *(pytest.param(k, marks=pytest.mark.soak) for k in range(count, soak))]
