"""The generated kernels of flexible bodies, for evaluation by NumPy."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from mstmm.ir import KernelIR
from mstmm.ir.element_spec import kernel_from_json


@cache
def kernel(name: str) -> KernelIR:
    """Kernel of the element "modal" with the given name."""
    text = files("mstmm.generated").joinpath("sweep_modal.json").read_text(encoding="utf-8")
    return kernel_from_json(text, name)
