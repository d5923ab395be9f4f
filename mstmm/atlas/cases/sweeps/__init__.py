"""Sweeps over the bodies."""
