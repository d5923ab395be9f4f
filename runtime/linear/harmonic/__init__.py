"""Harmonic motion: damping that is asked for, and beams by their dynamic stiffness."""
