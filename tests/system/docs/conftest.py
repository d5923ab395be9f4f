"""Pages are followed once; every test that looks at what a page says shares that."""

from __future__ import annotations

from functools import cache

import pytest

from tests.support.commands import folder, mstmm
from tests.support.pages import Follow, play

__all__ = ["folder", "mstmm", "play_page"]


@pytest.fixture(scope="session")
def play_page(tmp_path_factory: pytest.TempPathFactory) -> Follow:
    """Runs a page, such as "docs/howto/flexible-bodies.md", once; its names and its output."""
    return cache(lambda page: play(page, tmp_path_factory.mktemp("page")))
