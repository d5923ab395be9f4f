"""Evaluation of packed scenes: accelerations, inverse dynamics, observations, tangents."""
