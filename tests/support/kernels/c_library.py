"""Compile generated C in a temporary folder and call it through cffi in ABI mode."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cffi

import mstmm.runtime.engine
from mstmm.abi import element_library as abi
from mstmm.derive.codegen.template_rendering import write_generated
from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.tape import INSTRUCTION_WIDTH, OUTPUT_WIDTH, Tape

#: C of the looped engine.
ENGINE = Path(mstmm.runtime.engine.__path__[0], "c")

#: C17 with every warning an error; no contraction and no functions folded by the compiler, so that
#: each operation rounds as in Python.
FLAGS = (
    "-std=c17", "-O1", "-ffp-contract=off", "-fno-builtin", "-fPIC", "-pedantic", "-Wall",
    "-Wextra", "-Wshadow", "-Wmissing-prototypes", "-Wstrict-prototypes", "-Werror",
)  # fmt: skip


def compile_library(sources: Iterable[Path], target: Path, *flags: str) -> Path:
    """A shared library of the C files; the compiler's own words on failure."""
    compiler = shlex.split(os.environ.get("CC") or "") or [shutil.which("cc") or "gcc"]
    command = [*compiler, *FLAGS, *flags, "-shared", "-o", str(target), *map(str, sources), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return target


def build(folder: Path, *specs: ElementSpec, flags: Sequence[str] = ()) -> CLibrary:
    """Generate, compile and open the elements and the tape interpreter."""
    write_generated(specs, folder)
    stems = [*(f"{spec.kind}_{spec.name}" for spec in specs), "registry"]
    sources = [*(folder / f"{stem}.c" for stem in stems), ENGINE / "tape.c"]
    return open_library(compile_library(sources, folder / "elements.so", f"-I{folder}", *flags))


def open_library(path: Path) -> CLibrary:
    """A shared library of generated elements and the tape interpreter."""
    ffi = cffi.FFI()
    ffi.cdef(abi.cdef(registry=True, tape=True))
    return CLibrary(ffi, ffi.dlopen(str(path)))


@dataclass(frozen=True)
class Outcome:
    """What a C kernel returned and wrote."""

    code: int
    outputs: dict[str, list[float]]


class CLibrary:
    """An opened library of generated elements: calls go through the descriptors."""

    def __init__(self, ffi: Any, lib: Any) -> None:
        self.ffi, self.lib = ffi, lib
        table = [lib.mstmm_elements[i] for i in range(lib.mstmm_element_count)]
        #: Descriptors by name, and by kind_name.
        self.elements: dict[str, Any] = {self.text(e.name): e for e in table}
        self.elements |= {f"{self.text(e.kind)}_{self.text(e.name)}": e for e in table}

    def text(self, pointer: Any) -> str:
        """A C string as text."""
        found = self.ffi.string(pointer)
        assert isinstance(found, bytes)
        return found.decode()

    def kernel(self, element: str, name: str) -> Any:
        """Descriptor of a kernel."""
        found = self.elements[element]
        return next(
            found.kernels[i]
            for i in range(found.n_kernels)
            if self.text(found.kernels[i].name) == name
        )

    def call(
        self,
        element: str,
        name: str,
        inputs: Mapping[str, Sequence[float]],
        n: int = 0,
        start: float = 0.0,
    ) -> Outcome:
        """Run a kernel on flat inputs; every entry of the outputs holds `start` beforehand."""
        kernel = self.kernel(element, name)
        given = [
            self._array(kernel.inputs[i], n, inputs[self.text(kernel.inputs[i].name)])
            for i in range(kernel.n_inputs)
        ]
        names = [self.text(kernel.outputs[i].name) for i in range(kernel.n_outputs)]
        taken = [self._array(kernel.outputs[i], n, start) for i in range(kernel.n_outputs)]
        code = kernel.call(
            n, self.ffi.new("double *[]", given or 1), self.ffi.new("double *[]", taken or 1)
        )
        return Outcome(code, {name: list(row) for name, row in zip(names, taken, strict=True)})

    def _array(self, port: Any, n: int, values: Sequence[float] | float) -> Any:
        length = port.length * n**port.power
        row = [values] * length if isinstance(values, float) else list(values)
        assert len(row) == length, (self.text(port.name), length, len(row))
        return self.ffi.new("double[]", row)

    def run_tape(
        self, tape: Tape, inputs: Sequence[Sequence[float]], start: float = 0.0
    ) -> tuple[int, list[list[float]]]:
        """Interpret a tape in C on flat inputs, in the order of the ports."""
        new = self.ffi.new
        kept = [
            new("int[]", tape.input_lengths),
            new("double[]", tape.constants),
            new("int[]", tape.instructions),
            new("int[]", tape.outputs),
        ]
        lengths, constants, instructions, outputs = kept
        packed = new(
            "mstmm_tape *",
            {
                "n_inputs": len(tape.input_lengths),
                "input_lengths": lengths,
                "n_constants": len(tape.constants),
                "constants": constants,
                "n_slots": tape.slots,
                "n_instructions": len(tape.instructions) // INSTRUCTION_WIDTH,
                "instructions": instructions,
                "n_outputs": len(tape.outputs) // OUTPUT_WIDTH,
                "outputs": outputs,
            },
        )
        given = [new("double[]", list(row)) for row in inputs]
        taken = [new("double[]", [start] * length) for length in tape.output_lengths]
        code = self.lib.mstmm_tape_run(
            packed,
            new("double *[]", given or 1),
            new("double[]", tape.slots),
            new("double *[]", taken or 1),
        )
        return code, [list(row) for row in taken]


def are_same_numbers(left: Sequence[float], right: Sequence[float]) -> bool:
    """Equal number for number; a NaN equals a NaN."""
    return len(left) == len(right) and all(
        a == b or (a != a and b != b) for a, b in zip(left, right, strict=True)
    )
