"""Optimisation of straight-line code: order, balanced sums, paired sines and cosines."""
