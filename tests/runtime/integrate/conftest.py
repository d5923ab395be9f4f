"""The compiled test systems, built once."""

from __future__ import annotations

import pytest

from tests.support.integration.compiled_systems import Lab


@pytest.fixture(scope="session")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    """The time integration in C with the systems of `systems.c`."""
    return Lab(tmp_path_factory.mktemp("integrators"))
