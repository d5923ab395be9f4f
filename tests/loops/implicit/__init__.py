"""Implicit steps on closed loops."""
