"""Tangent kernels of one scene: interpreted, or compiled if that saves time."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure
from mstmm.ir import Constant, KernelIR, Store
from mstmm.ir.differentiation import DERIVATIVE_PREFIX, differentiate
from mstmm.ir.scene_structure import Structure

from ..kernels.derivative_library import DerivativeLibrary
from ..kernels.tape_kernel import TapeKernel
from .fused_code import FusedCode

#: Inputs of the kernel "accelerations", in order.
INPUTS = ("p", "t", "q", "u", "memory", "efforts")

#: Pairs (input, output): the output is differentiated with respect to the input.
PAIRS = (
    ("u", "qdot"), ("q", "qdot"), ("q", "udot"), ("u", "udot"), ("efforts", "udot"),
    ("t", "udot"), ("p", "udot"),
)  # fmt: skip

#: Number of directions that justifies a compilation.  The compilation time and the saving per
#: direction both grow with kernel size; measured break-even from 130 000 (7 balls) to 490 000
#: (24 pins).
WORTH_COMPILING = 300_000


class TangentKernels:
    """Derivatives of the accelerations of one structure along given directions.

    Thread-safe.  Compiled code and the interpreted tape agree to rounding.
    """

    def __init__(self, fusion: FusedCode, structure: Structure, parameters: bool) -> None:
        self._fusion, self.structure = fusion, structure
        self._pairs = PAIRS if parameters else PAIRS[:-1]
        self._tapes: dict[tuple[str, str], TapeKernel | None] = {}
        self._lock = threading.Lock()
        self._directions = 0
        self._obstacle = ""
        self._library = self._get(build=False)

    def expect(self, directions: int) -> None:
        """Announce a number of directions; the kernels are compiled once the total justifies it."""
        with self._lock:
            self._directions += directions
            if self._library is None and self._directions > WORTH_COMPILING:
                self._library = self._get(build=True)

    @property
    def uses_compiled_code(self) -> bool:
        """True if compiled code is in use."""
        return self._library is not None

    def columns(
        self, port: str, output: str, states: Mapping[str, Array], directions: Array
    ) -> Array:
        """Derivatives (states, n, length) of `output` along directions of the input `port`.

        `states[name]` is (states or 1, width) for every input, `directions` (states or 1, n,
        width).
        """
        if self._library is not None:
            inputs = [states[name] for name in INPUTS]
            return self._library.run(self._pairs.index((port, output)), inputs, directions)
        with self._lock:
            return self._evaluate_interpreted(port, output, states, directions)

    def _evaluate_interpreted(
        self, port: str, output: str, states: Mapping[str, Array], directions: Array
    ) -> Array:
        length = self.structure.nq if output == "qdot" else self.structure.nu
        sizes = [len(directions), *map(len, states.values())]
        count = max(sizes) if min(sizes) else 0
        derivative_rows = np.zeros((count, directions.shape[1], length))
        if (port, output) not in self._tapes:
            kernel = self._kernel(port, output)
            self._tapes[port, output] = None if _is_zero(kernel) else TapeKernel(kernel)
        tape = self._tapes[port, output]
        if tape is None:
            return derivative_rows
        for i in range(count):
            kernel_inputs = {name: rows[min(i, len(rows) - 1)] for name, rows in states.items()}
            for k, direction in enumerate(directions[min(i, len(directions) - 1)]):
                _, outputs = tape.run({**kernel_inputs, DERIVATIVE_PREFIX + port: direction})
                kernel_inputs = {}  # the kernel keeps the inputs of the state
                derivative_rows[i, k] = outputs[DERIVATIVE_PREFIX + output][:length]
        return derivative_rows

    @cached_property
    def _accelerations(self) -> KernelIR:
        kernel: KernelIR = self._fusion.structure_ir(self.structure).kernels["accelerations"]
        return kernel

    def _kernel(self, port: str, output: str) -> KernelIR:
        """Kernel of the derivative of `output` along a direction of `port`, without values."""
        return differentiate(self._accelerations, [port], [output], values=False, guards=False)

    def _get(self, build: bool) -> DerivativeLibrary | None:
        if self._obstacle:
            return None
        pairs_text = " ".join(f"{output}/{port}" for port, output in self._pairs)
        try:
            return self._fusion.columns(self.structure, self._kernels, pairs_text, build)
        except EnvironmentFailure as error:
            self._obstacle = str(error)
            return None

    def _kernels(self) -> Sequence[KernelIR]:
        return [self._kernel(port, output) for port, output in self._pairs]


def _is_zero(kernel: KernelIR) -> bool:
    """True if all results of the kernel are the constant zero."""
    stores = [statement for statement in kernel.statements if isinstance(statement, Store)]
    return all(statement.value == Constant("0") for statement in stores)
