"""Tapes of the derivatives of a scene's expressions, compiled on first use."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any

from mstmm.expression.inputs import INPUTS
from mstmm.ir import KernelIR
from mstmm.ir.differentiation import differentiate
from mstmm.ir.tape import compile_tape

from ...kernels.tape_kernel import c_tape
from ..system import System

#: Guards the compilation of tapes, which several threads may request.
LOCK = threading.Lock()


@dataclass
class Slopes:
    """Tapes of derivatives: their largest workspace, and references that keep them alive."""

    slots: int = 0
    keep_alive: list[Any] = field(default_factory=list)


def write_slopes(system: System, model: Any, ffi: Any) -> Slopes:
    """Write derivative tapes of drives, values, couplings and spring efforts to `model`."""
    slopes = Slopes()

    def tape(kernel: KernelIR | None) -> Any:
        if kernel is None:
            return ffi.NULL
        ports = [port.name for port in kernel.inputs if port.name != INPUTS]
        slope = compile_tape(differentiate(kernel, ports, values=False, guards=False))
        slopes.slots = max(slopes.slots, slope.slots)
        return c_tape(ffi, slope, slopes.keep_alive)

    model.drive_slopes, model.value_slopes = tape(system.drives), tape(system.values)
    model.coupling_slopes = tape(system.coupling_kernel)
    for k, force in enumerate(system.forces):
        model.forces[k].effort_slope = tape(force.effort)
    return slopes
