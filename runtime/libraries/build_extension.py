"""Build `mstmm.generated._kernels` from the C of several packages, and read its declarations.

setup.py executes this file inside pip's build isolation, where mstmm cannot be imported: it uses
the standard library, cffi and the headers of numpy, and paths relative to the project's root.

The C is generated (elements and kernels) and written by hand (engine, integration).  The
declarations for Python are in the headers, between the markers `/* cdef begin */` and
`/* cdef end */`: plain declarations, no preprocessor lines except integer `#define`s.  The
`#include "other.h"` lines of a header decide the order.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

from cffi import FFI

GENERATED = Path("generated")

#: Folders with the C of the module, and a folder whose text that C includes.
FOLDERS = (
    GENERATED, Path("runtime/engine/c"), Path("runtime/integrate/c"), Path("runtime/classical/c"),
    Path("runtime/engine/state_evaluation/c"),
)  # fmt: skip
INCLUDED_TEXT = Path("templates")
#: Unit that includes other .c files, which are not compiled separately.
INCLUDING_UNIT = Path("runtime/engine/c/passes.c")

MODULE = "mstmm.generated._kernels"

# -ffp-contract=off: a * b + c is rounded twice on every machine, so results do not depend on
# whether it has fused multiply-add, and the error bounds of the checks (one rounding per operation
# of the IR) hold.  -fno-math-errno: sqrt is one instruction; no value changes.  -g0: the flags of
# Python's own build request debugging information, nine tenths of the module's size.
COMPILE_ARGS = (
    "-std=c17", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden", "-g0",
)  # fmt: skip
WARNING_ARGS = ("-Wall", "-Wextra", "-Wno-unused-parameter")

#: String in the module that identifies the C text from which it was compiled.
BUILT_FROM = "mstmm_built_from"

_BLOCK = re.compile(r"/\* cdef begin \*/(.*?)/\* cdef end \*/", re.DOTALL)
_INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def headers(folders: Sequence[Path]) -> list[Path]:
    """Headers of `folders`, each after the headers that it includes, otherwise sorted by name.

    ValueError for a name in two folders, and for headers that include each other.
    """
    headers_by_name: dict[str, Path] = {}
    for header in (header for folder in folders for header in sorted(folder.glob("*.h"))):
        if header.name in headers_by_name:
            raise ValueError(f"{header} has the name of {headers_by_name[header.name]}")
        headers_by_name[header.name] = header
    ordered_headers: list[Path] = []

    def visit(header: Path, including: tuple[Path, ...]) -> None:
        if header in including:
            raise ValueError(f"{header} includes itself through {including[-1]}")
        if header in ordered_headers:
            return
        for name in _INCLUDE.findall(header.read_text()):
            visit(headers_by_name[name], (*including, header))
        ordered_headers.append(header)

    for name in sorted(headers_by_name):
        visit(headers_by_name[name], ())
    return ordered_headers


def cdef(header: Path) -> str:
    """Declarations of `header` for Python; ValueError if the markers do not pair up."""
    text = header.read_text()
    blocks = _BLOCK.findall(text)
    if not len(blocks) == text.count("/* cdef begin */") == text.count("/* cdef end */"):
        raise ValueError(f"{header}: 'cdef begin' and 'cdef end' do not pair up")
    return "\n".join(block.strip() for block in blocks)


def source_hash(root: Path) -> str:
    """SHA-256 of the C in the folders below `root`; "" without a manifest of the generated C.

    The manifest contains hashes of the generated text; the other files are read.
    """
    manifest = root / GENERATED / "manifest.json"
    if not manifest.is_file():
        return ""
    digest = hashlib.sha256(manifest.read_bytes())
    for path in hand_written_sources(root):
        digest.update(f"{path.name}\n".encode() + path.read_bytes())
    return digest.hexdigest()


def hand_written_sources(root: Path) -> list[Path]:
    """C files below `root` that are not generated, by folder and name."""
    folders = [root / folder for folder in FOLDERS if folder != GENERATED]
    paths = [path for folder in folders for path in sorted(folder.glob("*.[ch]"))]
    return [*paths, *sorted((root / INCLUDED_TEXT).glob("*.c"))]


def ffibuilder() -> FFI:
    """Define the extension module of the prebuilt kernels; for setup.py, in the project's root."""
    import numpy as np  # its headers, when the module is built

    if not any(GENERATED.glob("*.c")):
        raise FileNotFoundError(f"no C source in {GENERATED}/; run `python -m mstmm generate`")
    sources = [source for folder in FOLDERS for source in sorted(folder.glob("*.c"))]
    included_names = (
        _INCLUDE.findall(INCLUDING_UNIT.read_text()) if INCLUDING_UNIT.is_file() else ()
    )
    header_paths, included_sources = (
        headers(FOLDERS),
        [source for source in sources if source.name in included_names],
    )
    builder = FFI()
    builder.cdef("\n".join(cdef(header) for header in header_paths))
    builder.cdef(f"static char *const {BUILT_FROM};")
    identity = f'static char *const {BUILT_FROM} = "{source_hash(Path())}";'
    builder.set_source(
        MODULE,
        "\n".join([*(f'#include "{header.name}"' for header in header_paths), identity]),
        sources=[source.as_posix() for source in sources if source not in included_sources],
        depends=[
            path.as_posix()
            for path in (*header_paths, *included_sources, *sorted(INCLUDED_TEXT.glob("*.c")))
        ],
        include_dirs=[
            *(folder.as_posix() for folder in (*FOLDERS, INCLUDED_TEXT)),
            np.get_include(),
        ],
        extra_compile_args=[*COMPILE_ARGS, *WARNING_ARGS],
        libraries=["m"],
        py_limited_api=True,
    )
    return builder
