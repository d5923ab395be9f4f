"""Callable kernels: prebuilt, from the user's store, interpreted, evaluated by numpy, fused."""
