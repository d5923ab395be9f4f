"""Kernels that can be called: prebuilt, of the user's store, on the tape, by numpy, fused."""
