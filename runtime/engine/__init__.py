"""Evaluations of a packed scene: accelerations, inverse dynamics, observations, tangents."""
