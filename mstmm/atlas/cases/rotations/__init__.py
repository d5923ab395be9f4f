"""Coordinates of rotations."""
