"""Builds the compiled kernels, one binary for every Python from 3.11; see pyproject.toml."""

from setuptools import setup

setup(
    cffi_modules=["runtime/libraries/build_extension.py:ffibuilder"],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
