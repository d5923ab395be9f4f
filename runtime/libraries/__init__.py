"""Compiled libraries: compilers, the cache, building, testing and opening them."""
