"""Fixtures of the cache's tests."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, not made yet, and a compiler that nobody chose."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("MSTMM_CACHE", str(folder))
    for name in ("CC", "MSTMM_CACHE_SIZE", "MSTMM_COMPILE_TIMEOUT"):
        monkeypatch.delenv(name, raising=False)
    return folder
