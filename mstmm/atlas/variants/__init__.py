"""Variants of methods that are known to fail, built from the kernels of the correct ones.

Only cases of the atlas use them, never a simulation.
"""
