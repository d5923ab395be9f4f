"""Plots of linear models: matrices, modes and responses (extra: plot)."""
