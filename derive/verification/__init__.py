"""Checks of definitions, equations, kernels and their rounding errors."""
