"""Builds `mstmm.generated._kernels` from the committed C; also the one reader of its declarations.

setup.py executes this file inside pip's build isolation, where mstmm cannot be imported: it uses
the standard library and cffi alone, and paths relative to the project's root.

What Python may call is written once, in the generated headers, between the markers
`/* cdef begin */` and `/* cdef end */`: plain declarations, no preprocessor lines but integer
`#define`s.  A header's own `#include "other.h"` lines decide the order.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from cffi import FFI

GENERATED = Path("generated")
MODULE = "mstmm.generated._kernels"

# -ffp-contract=off: a * b + c is rounded twice on every machine, so results do not depend on
# whether it has fused multiply-add, and the error bounds of the checks (one rounding per operation
# of the IR) hold.  -fno-math-errno: sqrt is one instruction; no value changes.
COMPILE_ARGS = ("-std=c17", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden")
WARNING_ARGS = ("-Wall", "-Wextra", "-Wno-unused-parameter")

#: The string in the module that tells the C text it was compiled from.
BUILT_FROM = "mstmm_built_from"

_BLOCK = re.compile(r"/\* cdef begin \*/(.*?)/\* cdef end \*/", re.DOTALL)
_INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def headers(folder: Path) -> list[Path]:
    """The headers of `folder`, each after those it includes; by name where that leaves a choice."""
    ordered: list[Path] = []

    def visit(header: Path, including: tuple[Path, ...]) -> None:
        if header in including:
            raise ValueError(f"{header} includes itself by way of {including[-1]}")
        if header in ordered:
            return
        for name in _INCLUDE.findall(header.read_text()):
            visit(folder / name, (*including, header))
        ordered.append(header)

    for header in sorted(folder.glob("*.h")):
        visit(header, ())
    return ordered


def cdef(header: Path) -> str:
    """The declarations that `header` offers to Python; ValueError where a marker has no partner."""
    text = header.read_text()
    blocks = _BLOCK.findall(text)
    if not len(blocks) == text.count("/* cdef begin */") == text.count("/* cdef end */"):
        raise ValueError(f"{header}: 'cdef begin' and 'cdef end' do not pair up")
    return "\n".join(block.strip() for block in blocks)


def built_from(folder: Path) -> str:
    """SHA-256 of `folder`'s manifest, which names every text in it by its own; "" without one."""
    manifest = folder / "manifest.json"
    return hashlib.sha256(manifest.read_bytes()).hexdigest() if manifest.is_file() else ""


def ffibuilder() -> FFI:
    """The extension module of the prebuilt kernels; called by setup.py, in the project's root."""
    sources = sorted(GENERATED.glob("*.c"))
    if not sources:
        raise FileNotFoundError(f"{GENERATED}/ holds no C source; run `python -m mstmm generate`")
    found = headers(GENERATED)
    builder = FFI()
    builder.cdef("\n".join(cdef(header) for header in found))
    builder.cdef(f"static char *const {BUILT_FROM};")
    identity = f'static char *const {BUILT_FROM} = "{built_from(GENERATED)}";'
    builder.set_source(
        MODULE,
        "\n".join([*(f'#include "{header.name}"' for header in found), identity]),
        sources=[source.as_posix() for source in sources],
        depends=[header.as_posix() for header in found],
        include_dirs=[GENERATED.as_posix()],
        extra_compile_args=[*COMPILE_ARGS, *WARNING_ARGS],
        libraries=["m"],
        py_limited_api=True,
    )
    return builder
