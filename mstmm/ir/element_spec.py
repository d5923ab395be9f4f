"""ElementSpec: one element as numbers and text, ready to be printed as C or JSON.  No SymPy."""

from __future__ import annotations

import hashlib
import json
from dataclasses import astuple, dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from .hinge_properties import (
    HingeProperties,
    Param,
    hinge_properties_from_data,
    hinge_properties_to_data,
)
from .kernel import KernelIR, json_lines, kernel_from_data, kernel_to_data

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


# --- stored form: one file per element, one statement a line --------------------------------------


def element_to_json(spec: ElementSpec) -> str:
    """Convert an element to JSON, with the same bytes on every machine.

    `element_from_json` is the inverse.
    """
    head: dict[str, Any] = {
        "kind": spec.kind,
        "name": spec.name,
        "title": spec.title,
        "sources": list(spec.sources),
        "coordinates": [list(astuple(p)) for p in spec.coordinates],
        "speeds": [list(astuple(p)) for p in spec.speeds],
        "parameters": [list(astuple(p)) for p in spec.parameters],
    }
    if spec.facts is not None:
        head["facts"] = hinge_properties_to_data(spec.facts)
    kernels = ",\n".join(_kernel_lines(kernel, head["sources"]) for kernel in spec.kernels)
    return json_lines(head)[:-2] + ',\n"kernels": [\n' + kernels + "\n]}\n"


def _kernel_lines(kernel: KernelIR, element_sources: list[str]) -> str:
    """JSON of a kernel in its element, without sources if they are those of the element."""
    data = kernel_to_data(kernel)
    if data["sources"] == element_sources:
        del data["sources"]
    return json_lines(data).rstrip("\n")


def element_from_json(text: str) -> ElementSpec:
    """Restore an element from JSON.  ValueError if the text or one of its kernels is invalid."""
    data = json.loads(text)
    groups: dict[str, Any] = {
        group: tuple(Param(*entry) for entry in data[group])
        for group in ("coordinates", "speeds", "parameters")
    }
    kernels = tuple(kernel_from_data({"sources": data["sources"]} | k) for k in data["kernels"])
    facts = hinge_properties_from_data(data["facts"]) if "facts" in data else None
    return ElementSpec(
        kind=data["kind"], name=data["name"], title=data["title"], kernels=kernels,
        sources=tuple(data["sources"]), facts=facts, **groups,
    )  # fmt: skip


def kernels_from_json(text: str) -> dict[str, dict[str, Any]]:
    """Name -> data of the kernels of a stored element; see `kernel_from_data`."""
    data = json.loads(text)
    return {kernel["name"]: {"sources": data["sources"]} | kernel for kernel in data["kernels"]}


def kernel_from_json(text: str, name: str) -> KernelIR:
    """Restore one kernel of a stored element, without building the others.

    KeyError if the element has no kernel of this name; ValueError as for `element_from_json`.
    """
    return kernel_from_data(kernels_from_json(text)[name])


@cache
def builtin_kernel(stem: str, name: str) -> KernelIR:
    """Kernel of a built-in element such as "sweep_modal".  KeyError as for `kernel_from_json`."""
    return kernel_from_data(_builtin_kernels(stem)[name])


@cache
def _builtin_kernels(stem: str) -> dict[str, dict[str, Any]]:
    return kernels_from_json(
        files("mstmm.generated").joinpath(f"{stem}.json").read_text(encoding="utf-8")
    )
