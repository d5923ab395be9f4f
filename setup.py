"""Builds the compiled kernels, one binary for every Python from 3.11; see pyproject.toml."""

import hashlib
import json
import shutil
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.editable_wheel import editable_wheel

#: The variable that says how many files are compiled at a time, and how many are at most without.
JOBS, MOST = "MSTMM_BUILD_JOBS", 8


class OneFolder(editable_wheel):
    """An editable install is the path of this folder, whose links reach every room: a finder in
    code, which setuptools writes for rooms elsewhere, is what no type checker follows."""

    def finalize_options(self) -> None:
        self.distribution.package_dir = {"": "."}
        super().finalize_options()


class BuildOnce(build_ext):
    """What was compiled here from the same text, by the same command, is not compiled again: an
    install with another extra takes it as it is.  --force compiles anyway."""

    def build_extension(self, ext: Extension) -> None:
        here = Path(self.get_ext_filename(ext.name))
        target = Path(self.get_ext_fullpath(ext.name))
        record = Path("build", f"{here.name}.json")
        made_of = self._made_of(ext)
        if not self.force and here.is_file() and record.is_file():
            wanted = {"made_of": made_of, "sha256": _sha256(here)}
            if json.loads(record.read_text()) == wanted:
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(here, target)
                return
        super().build_extension(ext)
        record.parent.mkdir(exist_ok=True)
        record.write_text(json.dumps({"made_of": made_of, "sha256": _sha256(target)}))

    def _made_of(self, ext: Extension) -> str:
        """Hash of all C, of the command and of the numpy whose headers it includes."""
        import numpy

        command = [*self.compiler.compiler_so, *self.compiler.linker_so, *ext.extra_compile_args]
        digest = hashlib.sha256(json.dumps([command, numpy.__version__]).encode())
        for path in sorted(map(Path, (*ext.sources, *ext.depends)), key=lambda path: path.name):
            digest.update(f"{path.name} {_sha256(path)}\n".encode())
        return digest.hexdigest()


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


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
        cmdclass={"build_ext": BuildOnce, "editable_wheel": OneFolder},
    )
