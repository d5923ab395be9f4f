"""How the declarations for Python are read out of the headers."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from mstmm.errors import EnvironmentFailure
from mstmm.runtime.kernels import prebuilt_kernels
from mstmm.runtime.libraries.build_extension import (
    FOLDERS,
    GENERATED,
    INCLUDED_TEXT,
    cdef,
    hand_written_sources,
    headers,
    source_hash,
)
from tests.support.paths import ROOT

INNER = """\
#ifndef INNER_H
#define INNER_H
/* cdef begin */
typedef double real;
/* cdef end */
#define HIDDEN 1
/* cdef begin */
extern const real half;
/* cdef end */
#endif
"""
OUTER = """\
#include <math.h>
#include "z_inner.h"
/* cdef begin */
int twice(const real *restrict x, real *restrict y);
/* cdef end */
"""
SOURCE = """\
#include "a_outer.h"
const real half = 0.5;
int twice(const real *restrict x, real *restrict y) { y[0] = 2 * x[0]; return 7; }
"""
BY_HAND = """\
#include "a_outer.h"
#include "four_times.h"
int four_times(const real *restrict x, real *restrict y) {
    real two;
    twice(x, &two);
    return twice(&two, y);
}
"""
BY_HAND_HEADER = """\
#include "z_inner.h"
/* cdef begin */
int four_times(const real *restrict x, real *restrict y);
/* cdef end */
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with the builder, a generated C file with two headers, and one written by hand."""
    (tmp_path / "generated").mkdir()
    (tmp_path / "mstmm").mkdir()
    (tmp_path / "generated" / "z_inner.h").write_text(INNER)
    (tmp_path / "generated" / "a_outer.h").write_text(OUTER)
    (tmp_path / "generated" / "twice.c").write_text(SOURCE)
    room = tmp_path / "runtime" / "engine" / "c"
    room.mkdir(parents=True)
    (room / "four_times.c").write_text(BY_HAND)
    (room / "four_times.h").write_text(BY_HAND_HEADER)
    builder = Path("runtime", "libraries", "build_extension.py")
    (tmp_path / builder.parent).mkdir()
    shutil.copy(ROOT / builder, tmp_path / builder)
    shutil.copy(ROOT / "setup.py", tmp_path)
    return tmp_path


def test_headers_come_after_what_they_include(project: Path) -> None:
    found = headers([project / "generated", project / "runtime" / "engine" / "c"])
    assert [header.name for header in found] == ["z_inner.h", "a_outer.h", "four_times.h"]


def test_headers_of_one_name_are_refused(tmp_path: Path) -> None:
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "a.h").touch()
    with pytest.raises(ValueError, match=r"other/a\.h has the name of .*one/a\.h"):
        headers([tmp_path / "one", tmp_path / "other"])


def test_headers_that_include_each_other_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.h").write_text('#include "b.h"\n')
    (tmp_path / "b.h").write_text('#include "a.h"\n')
    with pytest.raises(ValueError, match=r"a\.h includes itself through .*b\.h"):
        headers([tmp_path])


def test_all_blocks_are_read_and_nothing_else(project: Path) -> None:
    text = cdef(project / "generated" / "z_inner.h")
    assert text.splitlines() == ["typedef double real;", "extern const real half;"]


@pytest.mark.parametrize("mark", ["/* cdef begin */", "/* cdef end */"])
def test_a_marker_without_its_partner_is_refused(tmp_path: Path, mark: str) -> None:
    header = tmp_path / "lonely.h"
    header.write_text(f"int f(void);\n{mark}\n")
    with pytest.raises(ValueError, match=r"lonely\.h: .* do not pair up"):
        cdef(header)


def build(project: Path) -> subprocess.CompletedProcess[str]:
    """Builds the extension of a project in place."""
    return subprocess.run(
        [sys.executable, "setup.py", "-q", "build_ext", "--inplace"],
        cwd=project,
        capture_output=True,
        text=True,
        check=False,
    )


def test_extension_is_built_for_every_python(project: Path) -> None:
    (project / "mstmm" / "__init__.py").touch()
    (project / "mstmm" / "generated").symlink_to("../generated")
    done = build(project)
    assert done.returncode == 0, done.stderr
    assert (project / "mstmm" / "generated" / "_kernels.abi3.so").exists()
    script = (
        "from mstmm.generated._kernels import ffi, lib\n"
        "y = ffi.new('double[1]')\n"
        "assert lib.twice([1.5], y) == 7 and y[0] == 3.0 and lib.half == 0.5\n"
        "assert lib.four_times([1.5], y) == 7 and y[0] == 6.0\n"
        "assert not hasattr(lib, 'HIDDEN')\n"
    )
    subprocess.run([sys.executable, "-c", script], cwd=project, check=True)


def test_what_is_compiled_already_is_not_compiled_again(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Until C, or what is installed, is something else."""
    (project / "mstmm" / "__init__.py").touch()
    (project / "mstmm" / "generated").symlink_to("../generated")
    calls, compiler = project / "calls", project / "cc"
    compiler.write_text(f'#!/bin/sh\necho "$@" >>{calls}\nexec cc "$@"\n')
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))

    def compiler_calls() -> int:
        """How often the compiler was called for an object; nothing but the module is left of the
        last build, as after an install."""
        calls.write_text("")
        for folder in [*(project / "build").glob("lib.*"), *(project / "build").glob("temp.*")]:
            shutil.rmtree(folder)
        done = build(project)
        assert done.returncode == 0, done.stderr
        return sum(" -c " in f" {line} " for line in calls.read_text().splitlines())

    assert (compiler_calls(), compiler_calls()) == (3, 0)
    source = project / "generated" / "twice.c"
    source.write_text(source.read_text().replace("2 *", "3 *"))
    assert (compiler_calls(), compiler_calls()) == (3, 0)
    (project / "mstmm" / "generated" / "_kernels.abi3.so").write_bytes(b"")
    assert (compiler_calls(), compiler_calls()) == (3, 0)


def test_a_folder_without_c_says_how_to_get_it(project: Path) -> None:
    (project / "generated" / "twice.c").unlink()
    done = build(project)
    assert done.returncode != 0
    assert "run `python -m mstmm generate`" in done.stderr


def test_a_module_from_other_text_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """After an update the module beside the new C may be the old one, with other functions."""
    again = r"_kernels.* belong to another version of mstmm; rebuild them: pip install -e \."
    assert prebuilt_kernels.module.__wrapped__() == prebuilt_kernels.module()
    with monkeypatch.context() as patch:
        patch.setattr(prebuilt_kernels, "source_hash", lambda folder: "0" * 64)
        with pytest.raises(EnvironmentFailure, match=again):
            prebuilt_kernels.module.__wrapped__()
    older = SimpleNamespace(
        ffi=prebuilt_kernels.module()[0], lib=object(), __file__="_kernels.abi3.so"
    )
    monkeypatch.setattr(prebuilt_kernels, "import_module", lambda name: older)
    with pytest.raises(EnvironmentFailure, match=again):
        prebuilt_kernels.module.__wrapped__()


def test_the_manifest_tells_every_generated_text(tmp_path: Path) -> None:
    texts = [path for ending in ("*.c", "*.h") for path in (ROOT / "generated").glob(ending)]
    digest = hashlib.sha256()
    for path in sorted(texts, key=lambda path: path.name):
        digest.update(f"{path.name}\n".encode() + path.read_bytes())
    manifest = json.loads((ROOT / "generated" / "manifest.json").read_text())
    assert manifest["sources"] == digest.hexdigest()
    assert source_hash(tmp_path) == ""


def test_a_change_of_any_text_is_noticed(project: Path) -> None:
    manifest = project / "generated" / "manifest.json"
    manifest.write_text("{}")
    (project / "templates").mkdir()
    (project / "templates" / "fused_text.c").touch()
    found = {source_hash(project)}
    by_hand = hand_written_sources(project)
    assert {path.name for path in by_hand} == {"four_times.c", "four_times.h", "fused_text.c"}
    for number, path in enumerate((manifest, *by_hand), 1):
        path.write_text(path.read_text() + "\n")
        found.add(source_hash(project))
        assert len(found) == 1 + number


def test_the_c_that_is_built_is_the_c_that_is_watched() -> None:
    watched = {path.relative_to(ROOT) for path in hand_written_sources(ROOT)}
    for folder in (*FOLDERS, INCLUDED_TEXT):
        if folder != GENERATED:
            there = {path.relative_to(ROOT) for path in (ROOT / folder).glob("*.[ch]")}
            assert there and there <= watched
