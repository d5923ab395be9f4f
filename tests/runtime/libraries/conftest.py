"""Fixtures of the cache's tests."""

from tests.support.libraries.fixtures import cache_folder

__all__ = ["cache_folder"]
