"""Builds the compiled kernels, one binary for every Python from 3.11; see pyproject.toml."""

from setuptools import setup
from setuptools.command.editable_wheel import editable_wheel


class OneFolder(editable_wheel):
    """An editable install is the path of this folder, whose links reach every room: a finder in
    code, which setuptools writes for rooms elsewhere, is what no type checker follows."""

    def finalize_options(self) -> None:
        self.distribution.package_dir = {"": "."}
        super().finalize_options()


setup(
    cffi_modules=["runtime/libraries/build_extension.py:ffibuilder"],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
    cmdclass={"editable_wheel": OneFolder},
)
