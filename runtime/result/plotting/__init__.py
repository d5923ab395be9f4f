"""Plots of quantities: default quantities, panels of curves, figures."""
