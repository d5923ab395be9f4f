"""Fixtures of the command line's tests."""

from cli.commands import folder, mstmm

__all__ = ["folder", "mstmm"]
