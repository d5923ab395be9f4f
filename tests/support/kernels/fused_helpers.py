"""Straight-line kernels as C for one state and for lanes, compiled together, called from numpy."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.abi.fused_library import COMPILER_FLAGS
from mstmm.derive.codegen.scene_text import function_text, support_text
from mstmm.derive.codegen.straight_line import LANE_DIALECT, SCALAR_DIALECT
from mstmm.ir import KernelIR

Array = NDArray[np.float64]

#: Compilers of this machine; CC first.
COMPILERS = tuple(
    dict.fromkeys(
        name for name in (os.environ.get("CC"), "gcc", "clang") if name and shutil.which(name)
    )
)
#: Widths of lanes by the flags that give them: the machine's own; on x86 every narrower one, and
#: the text for processors that it knows nothing about.
WIDTHS: dict[str, tuple[str, ...]] = {"native": ()} | (
    {
        "avx2": ("-mno-avx512f",),
        "sse2": ("-march=x86-64",),
        "plain": ("-march=x86-64", "-U__SSE2__"),
    }
    if platform.machine() == "x86_64"
    else {}
)

_HEAD = """\
typedef double real;
#define MSTMM_FUNCTION(name) name
#define MSTMM_LITERAL(number) number
"""
_SINES = """
void four_sines(const double *x, double *sine, double *cosine, int n);
void four_sines(const double *x, double *sine, double *cosine, int n)
{
    for (int i = 0; i + 4 <= n; i += 4) {
        const four_sincos_t pair = four_sincos((four_t){x[i], x[i + 1], x[i + 2], x[i + 3]});
        for (int k = 0; k < 4; k++) sine[i + k] = pair.sine[k], cosine[i + k] = pair.cosine[k];
    }
}
void lanes_sines(const double *x, double *sine, double *cosine, int n);
void lanes_sines(const double *x, double *sine, double *cosine, int n)
{
    for (int i = 0; i + MSTMM_LANES <= n; i += MSTMM_LANES) {
        const lanes_sincos_t pair = lanes_sincos(*(const lanes_array_t *)(x + i));
        *(lanes_array_t *)(sine + i) = pair.sine;
        *(lanes_array_t *)(cosine + i) = pair.cosine;
    }
}
int lanes_width(void);
int lanes_width(void) { return MSTMM_LANES; }
"""


def _caller(kernel: KernelIR) -> str:
    counts = [len(kernel.inputs), len(kernel.outputs)]
    words = [f"in[{i}]" for i in range(counts[0])] + [f"out[{i}]" for i in range(counts[1])]
    lanes = [f"(const lanes_array_t *)in[{i}]" for i in range(counts[0])]
    lanes += [f"(lanes_array_t *)out[{i}]" for i in range(counts[1])]
    arrays = "const double *const *in, double *const *out"
    return (
        f"int {kernel.name}_one({arrays});\n"
        f"int {kernel.name}_one({arrays}) {{ return {kernel.name}({', '.join(words)}); }}\n"
        f"int {kernel.name}_side({arrays}, int *codes);\n"
        f"int {kernel.name}_side({arrays}, int *codes)\n"
        f"{{ return {kernel.name}_lanes({', '.join(lanes)}, codes); }}\n"
    )


class FusedLab:
    """The kernels of one C text, compiled with one compiler."""

    def __init__(
        self, folder: Path, kernels: Sequence[KernelIR], compiler: str, flags: Sequence[str] = ()
    ) -> None:
        texts = [
            _HEAD,
            *(support_text(name) for name in ("scalar_type", "sincos", "four_lanes", "lanes")),
            _SINES,
        ]
        for kernel in kernels:
            texts.append(function_text(kernel, kernel.name, SCALAR_DIALECT))
            texts.append(function_text(kernel, f"{kernel.name}_lanes", LANE_DIALECT))
            texts.append(_caller(kernel))
        source, target = folder / "lab.c", folder / "lab.so"
        source.write_text("\n".join(texts))
        command = [
            compiler,
            *COMPILER_FLAGS,
            *flags,
            "-Wall",
            "-Wextra",
            "-Wmissing-prototypes",
            "-Werror",
            "-Wno-psabi",
            "-fPIC",
            "-shared",
            str(source),
            "-o",
            str(target),
            "-lm",
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        self._library = ctypes.CDLL(str(target))
        self.kernels = {kernel.name: kernel for kernel in kernels}
        self.lanes = int(self._library.lanes_width())

    def evaluate_state(self, name: str, inputs: Mapping[str, Any]) -> tuple[int, dict[str, Array]]:
        """(code, outputs) of the kernel for one state."""
        kernel = self.kernels[name]
        given = [np.array(inputs[p.name], dtype=float).ravel() for p in kernel.inputs]
        taken = [np.zeros(p.length()) for p in kernel.outputs]
        code = getattr(self._library, f"{name}_one")(_pointers(given), _pointers(taken))
        return code, {p.name: row for p, row in zip(kernel.outputs, taken, strict=True)}

    def side_by_side(
        self, name: str, states: Sequence[Mapping[str, Any]]
    ) -> tuple[list[int], list[dict[str, Array]]]:
        """(codes, outputs) of as many states as there are lanes."""
        kernel = self.kernels[name]
        assert len(states) == self.lanes
        given = [
            np.array([np.ravel(state[p.name]) for state in states], dtype=float).T.copy()
            for p in kernel.inputs
        ]
        taken = [np.zeros((p.length(), self.lanes)) for p in kernel.outputs]
        codes = np.full(self.lanes, -1, dtype=np.int32)
        found = getattr(self._library, f"{name}_side")(
            _pointers(given), _pointers(taken), ctypes.c_void_p(codes.ctypes.data)
        )
        assert bool(found) == bool(codes.any())
        outputs = [
            {p.name: rows[:, k] for p, rows in zip(kernel.outputs, taken, strict=True)}
            for k in range(self.lanes)
        ]
        return [int(code) for code in codes], outputs

    def sines(self, which: str, x: Array) -> tuple[Array, Array]:
        """(sine, cosine) by "four" or "lanes"; the length of x is a multiple of eight."""
        sine, cosine = np.zeros_like(x), np.zeros_like(x)
        arrays = [ctypes.c_void_p(array.ctypes.data) for array in (x, sine, cosine)]
        getattr(self._library, f"{which}_sines")(*arrays, len(x))
        return sine, cosine


def _pointers(arrays: Sequence[Array]) -> Any:
    return (ctypes.c_void_p * max(1, len(arrays)))(*(array.ctypes.data for array in arrays))
