"""Catalogue of all elements and kernels, and generation of `generated/`."""
