"""Pages are followed once; every test that looks at what a page says shares that."""

from __future__ import annotations

from functools import cache

import pytest

from tests.support.commands import folder, mstmm
from tests.support.pages import Follow, play

__all__ = ["folder", "mstmm", "played"]


@pytest.fixture(scope="session")
def played(tmp_path_factory: pytest.TempPathFactory) -> Follow:
    """What became of a page, such as "docs/howto/flexible-bodies.md"."""
    return cache(lambda page: play(page, tmp_path_factory.mktemp("page")))
