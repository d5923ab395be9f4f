"""Helpers that several test files use, by topic."""
