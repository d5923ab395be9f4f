"""Builds the compiled kernels; everything else is in pyproject.toml."""

from setuptools import setup

setup(cffi_modules=["runtime/build_extension.py:ffibuilder"])
