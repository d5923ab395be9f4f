"""Flexible bodies: floating-frame residual, sections as ports, local condensation."""
