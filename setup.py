"""Builds the compiled kernels, one binary for every Python from 3.11; see pyproject.toml."""

from contextlib import AbstractContextManager, nullcontext
from typing import Any

from setuptools import setup
from setuptools.command.editable_wheel import editable_wheel

#: The variable that says how many files are compiled at a time, and how many are at most without.
JOBS, MOST = "MSTMM_BUILD_JOBS", 8


class OneFolder(editable_wheel):
    """An editable install is the path of this folder, whose links reach every room: a finder in
    code, which setuptools writes for rooms elsewhere, is what no type checker follows."""

    def finalize_options(self) -> None:
        self.distribution.package_dir = {"": "."}
        super().finalize_options()


def side_by_side() -> AbstractContextManager[Any]:
    """Files of C are compiled on all cores; one after the other where pybind11 is missing, whose
    helper does it."""
    try:
        from pybind11.setup_helpers import ParallelCompile
    except ImportError:
        return nullcontext()
    return ParallelCompile(JOBS, max=MOST)


with side_by_side():
    setup(
        cffi_modules=["runtime/libraries/build_extension.py:ffibuilder"],
        options={"bdist_wheel": {"py_limited_api": "cp311"}},
        cmdclass={"editable_wheel": OneFolder},
    )
