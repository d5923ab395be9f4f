"""Fixtures: one laboratory for all tests of a module."""

from collections.abc import Iterator

import pytest

from tests.support.commands import folder, mstmm
from tests.support.interrupts.interrupted_commands import Laboratory

__all__ = ["folder", "laboratory", "mstmm"]


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    made = Laboratory(tmp_path_factory.mktemp("laboratory"))
    yield made
    made.close()
