"""Smallest sufficient model of a scene for a target error, with method and tolerance."""
