"""Compiled libraries: compilers, cache, build, test and loading."""
