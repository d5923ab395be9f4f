"""Harmonic response: hysteretic and modal damping, beams with dynamic stiffness."""
