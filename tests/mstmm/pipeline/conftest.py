"""Fixtures of the tests of fused code."""

from tests.support.libraries.fixtures import cache_folder

__all__ = ["cache_folder"]
