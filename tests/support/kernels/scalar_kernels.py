"""Kernels compiled in a real type of choice: references in quadruple precision."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import cffi
import numpy as np

from mstmm.derive.codegen.scalar_function import scalar_source
from mstmm.ir import KernelIR

Exact = list[Fraction]

DRIVER = Path(__file__).with_name("scalar_driver.c")
#: Quadruple operations are calls: optimising costs time and gains none.
FLAGS = ("-std=gnu17", "-O0", "-ffp-contract=off", "-fPIC", "-shared", "-Wall", "-Werror")
DECLARATIONS = """
int scalar_call(const double *const *inputs, double *const *high, double *const *low);
int scalar_motion(const double *const *inputs, double t_end, int steps, int columns, double *high,
                  double *low);
"""


class ScalarKernel:
    """One kernel in a type of `mstmm.derive.codegen.scalar_function`; outputs are exact
    fractions."""

    def __init__(self, kernel: KernelIR, scalar: str, folder: Path) -> None:
        self.kernel = kernel
        ports = (*kernel.inputs, *kernel.outputs)
        arrays = [f"in[{k}]" for k in range(len(kernel.inputs))]
        arrays += [f"out[{k}]" for k in range(len(kernel.outputs))]
        defined = {
            "N_IN": len(kernel.inputs),
            "N_OUT": len(kernel.outputs),
            "LENGTH": max(1, *(port.length() for port in ports)),
            "IN_LENGTHS": ", ".join(str(port.length()) for port in kernel.inputs),
            "OUT_LENGTHS": ", ".join(str(port.length()) for port in kernel.outputs),
            "CALL(in, out)": f"kernel_{kernel.name}({', '.join(arrays)})",
        }
        lines = [f"#define {name} {value}" for name, value in defined.items()]
        text = [scalar_source(kernel, scalar), *lines, DRIVER.read_text("utf-8")]
        source, library = folder / f"{scalar}.c", folder / f"{scalar}.so"
        source.write_text("\n".join(text), encoding="utf-8")
        command = ["gcc", *FLAGS, "-o", str(library), str(source), "-lquadmath", "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        self.ffi = cffi.FFI()
        self.ffi.cdef(DECLARATIONS)
        self.lib: Any = self.ffi.dlopen(str(library))

    def _inputs(self, inputs: Mapping[str, Sequence[float]]) -> tuple[Any, list[Any]]:
        kept = [
            self.ffi.new("double[]", [float(x) for x in inputs[port.name]] or [0.0])
            for port in self.kernel.inputs
        ]
        return self.ffi.new("const double *[]", kept), kept

    def __call__(self, inputs: Mapping[str, Sequence[float]]) -> dict[str, Exact]:
        """Outputs by port; inputs are taken as the doubles they are.  ValueError with the code of
        a guard that fails."""
        given, kept = self._inputs(inputs)
        parts = [
            [self.ffi.new("double[]", max(1, port.length())) for port in self.kernel.outputs]
            for _ in range(2)
        ]
        code = self.lib.scalar_call(given, *(self.ffi.new("double *[]", part) for part in parts))
        del kept
        if code:
            raise ValueError(f"guard {code}")
        return {
            port.name: _exact_values(*(list(part[k])[: port.length()] for part in parts))
            for k, port in enumerate(self.kernel.outputs)
        }

    def motion(
        self, inputs: Mapping[str, Sequence[float]], t_end: float, steps: int, columns: int = 10
    ) -> tuple[Exact, Exact]:
        """(q, u) at t_end of a kernel "accelerations", in equal steps of order 2 `columns`."""
        given, kept = self._inputs(inputs)
        nq, nu = (port.length() for port in self.kernel.outputs)
        high, low = (self.ffi.new("double[]", nq + nu) for _ in range(2))
        code = self.lib.scalar_motion(given, t_end, steps, columns, high, low)
        del kept
        if code:
            raise ValueError(f"guard {code}")
        y = _exact_values(list(high), list(low))
        return y[:nq], y[nq:]


def _exact_values(high: Sequence[float], low: Sequence[float]) -> Exact:
    return [Fraction(a) + Fraction(b) for a, b in zip(high, low, strict=True)]


def farthest(found: Any, wanted: Exact) -> float:
    """Largest difference relative to the largest wanted entry."""
    size = max(map(abs, wanted))
    values = [Fraction(float(x)) for x in np.asarray(found, dtype=float)]
    return float(max(abs(a - b) for a, b in zip(values, wanted, strict=True)) / size)
