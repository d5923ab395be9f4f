"""Numerics without numpy: rotations, dual numbers, symbolic numbers, piecewise polynomials."""
