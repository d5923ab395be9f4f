"""Flexible bodies: floating-frame residual by invariants, sections as ports, local condensation."""
