"""Mechanisms with closed loops that others have published."""
