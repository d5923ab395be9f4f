"""CasADi's articulated-body algorithm as C, compiled and ready for the timing loops."""

from __future__ import annotations

import ctypes
import tempfile
from pathlib import Path

import casadi as ca
import numpy as np

from . import native
from .aba import articulated_body
from .links import COORDINATES, Tree

HEAD = """
/* Only called here, so that the compiler inlines it and drops its checks of NULL. */
#define CASADI_SYMBOL_EXPORT static inline
"""

WRAPPER = """
__attribute__((visibility("default")))
int evaluate(const double *restrict p, const double *restrict t, const double *restrict q,
             const double *restrict u, const double *restrict memory,
             const double *restrict efforts, double *restrict qdot, double *restrict udot)
{
    double *res[] = {qdot, udot};
    (void)t, (void)memory;
    %s
    return aba(arg, res, 0, 0, 0);
}
"""

#: The function as CasADi writes it.
CALL_ARGUMENTS = "const double *arg[] = {p, q, u, efforts};"

#: All sines and cosines first, so that no call splits the rest: libm's, or eight at a time glibc's
#: vector library (at most 4 units in the last place off).
PRECOMPUTED_SINES = """
    double angles[PINS + 7] = {0}, sines[PINS + 7], cosines[PINS + 7];
    static const int place[] = {%s};
    for (int i = 0; i < PINS; i++) angles[i] = q[place[i]];
    %s
    const double *arg[] = {p, q, u, efforts, sines, cosines};
"""
LIBM = "for (int i = 0; i < PINS; i++) sincos(angles[i], sines + i, cosines + i);"
LIBMVEC = """for (int i = 0; i < PINS; i += WIDE) {
        vector x;
        __builtin_memcpy(&x, angles + i, sizeof x);
        const vector s = VECTOR_SIN(x), c = VECTOR_COS(x);
        __builtin_memcpy(sines + i, &s, sizeof s);
        __builtin_memcpy(cosines + i, &c, sizeof c);
    }"""
DECLARATIONS = """#define _GNU_SOURCE
#include <math.h>
#define PINS %d
#define WIDE %d
typedef double vector __attribute__((vector_size(8 * WIDE)));
#define VECTOR_SIN %s_sin
#define VECTOR_COS %s_cos
vector VECTOR_SIN(vector), VECTOR_COS(vector);
"""

_COMMON = ("-march=native", "-fno-math-errno", "-fno-trapping-math")
#: Compiler flags by name; the best of them counts.  They change results by contraction only.
FLAGS = {
    "O2": ("-O2", *_COMMON), "O2 scalar": ("-O2", *_COMMON, "-fno-tree-slp-vectorize"),
    "O3": ("-O3", *_COMMON),
}  # fmt: skip


def c_text(function: ca.Function) -> str:
    """C of a CasADi function."""
    with tempfile.TemporaryDirectory() as folder:
        generator = ca.CodeGenerator("aba.c")
        generator.add(function)
        generator.generate(folder + "/")
        return (Path(folder) / "aba.c").read_text()


def text_of(tree: Tree, baked: bool, sines: str) -> tuple[str, np.ndarray]:
    """C with the common signature, and its parameters; sines: "", "libm", "libmvec4", "8"."""
    function, numbers = articulated_body(tree, baked, precomputed_sines=bool(sines))
    if not sines:
        return HEAD + c_text(function) + WRAPPER % CALL_ARGUMENTS, numbers
    offset, indices = 0, []
    for link in tree.links:
        if link.kind == "pin":
            indices.append(str(offset))
        offset += COORDINATES[link.kind][0]
    width = 8 if sines.endswith("8") else 4
    name = "_ZGVeN8v" if width == 8 else "_ZGVdN4v"
    declarations = DECLARATIONS % (len(indices), width, name, name)
    prelude = PRECOMPUTED_SINES % (", ".join(indices), LIBM if sines == "libm" else LIBMVEC)
    return declarations + HEAD + c_text(function) + WRAPPER % prelude, numbers


def subjects(
    tree: Tree,
    q: np.ndarray,
    u: np.ndarray,
    baked: bool,
    flags: dict[str, tuple[str, ...]] = FLAGS,
    sines: tuple[str, ...] = ("", "libm", "libmvec4", "libmvec8"),
) -> dict[str, native.Subject]:
    """Flags' name -> function and states."""
    subjects_by_name = {}
    pins = any(link.kind == "pin" for link in tree.links)
    for sine_source in (s for s in sines if pins or not s):
        text, numbers = text_of(tree, baked, sine_source)
        for name, flag_list in flags.items():
            options = [*flag_list, "-std=gnu17", "-fvisibility=hidden", "-w"]
            path = native.compile_library("casadi", text, options, libraries=["-lmvec"])
            shared_library = ctypes.CDLL(str(path))
            address = ctypes.cast(shared_library.evaluate, ctypes.c_void_p).value
            subjects_by_name[f"{name} {sine_source}".strip()] = native.Subject(
                address, numbers, q, u, owner=shared_library
            )
    return subjects_by_name
