"""ElementSpec: one element as numbers and text, ready to be printed as C.  No SymPy."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from .hinge_properties import HingeProperties
from .kernel import KernelIR
from .param import Param

__all__ = ["ENTRY_POINTS", "ElementSpec", "Param"]

#: Entry point group in which installed packages list their elements: a class, or a module of them.
ENTRY_POINTS = "mstmm.elements"


@dataclass(frozen=True)
class ElementSpec:
    """Coordinates, parameters and kernels of an element, as code generation needs them.

    `kind` is one of hinge, body, force, law, sweep, classical; hinges have `facts`.
    """

    kind: str
    name: str
    title: str
    coordinates: tuple[Param, ...]
    speeds: tuple[Param, ...]
    parameters: tuple[Param, ...]
    kernels: tuple[KernelIR, ...]
    sources: tuple[str, ...] = ()
    facts: HingeProperties | None = None

    def hash(self) -> str:
        """SHA-256 of everything that appears in the C file."""
        parts = [self.kind, self.name]
        for group in (self.coordinates, self.speeds, self.parameters):
            parts += [f"{p.name}|{p.unit}" for p in group]
        parts += [kernel.hash() for kernel in self.kernels]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()
