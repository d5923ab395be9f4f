"""Products of transfer matrices."""
