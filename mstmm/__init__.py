"""mstmm: transfer matrix method for multibody systems."""
