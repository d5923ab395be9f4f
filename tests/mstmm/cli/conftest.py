"""Fixtures of the command line's tests."""

from tests.support.commands import folder, mstmm

__all__ = ["folder", "mstmm"]
