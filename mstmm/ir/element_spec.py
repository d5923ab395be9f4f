"""ElementSpec: one element as numbers and text, ready to be printed as C or JSON.  No SymPy."""

from __future__ import annotations

import hashlib
import json
from dataclasses import astuple, dataclass
from typing import Any

from .hinge_properties import (
    HingeProperties,
    Param,
    hinge_properties,
    hinge_properties_from_data,
    hinge_properties_to_data,
)
from .kernel import KernelIR, kernel_from_data, to_json

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


# --- stored form: one file per element, kernels as written by ir.to_json --------------------------


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
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    kernels = ",\n".join(to_json(kernel).rstrip("\n") for kernel in spec.kernels)
    return "{\n" + ",\n".join(lines) + ',\n"kernels": [\n' + kernels + "\n]}\n"


def element_from_json(text: str) -> ElementSpec:
    """Restore an element from JSON.  ValueError if the text or one of its kernels is invalid."""
    data = json.loads(text)
    groups: dict[str, Any] = {
        group: tuple(Param(*entry) for entry in data[group])
        for group in ("coordinates", "speeds", "parameters")
    }
    kernels = tuple(map(kernel_from_data, data["kernels"]))
    facts = None
    if "facts" in data:
        facts = hinge_properties_from_data(data["facts"])
    elif data["kind"] == "hinge":  # stored by a version whose hinges had no facts
        motion = [kernel for kernel in kernels if kernel.name == "hinge"]
        facts = hinge_properties(motion[0], data["name"], **groups) if motion else None
    return ElementSpec(
        kind=data["kind"], name=data["name"], title=data["title"], kernels=kernels,
        sources=tuple(data["sources"]), facts=facts, **groups,
    )  # fmt: skip


def kernel_from_json(text: str, name: str) -> KernelIR:
    """Restore one kernel of a stored element, without building the others.

    KeyError if the element has no kernel of this name; ValueError as for `element_from_json`.
    """
    stored = {kernel["name"]: kernel for kernel in json.loads(text)["kernels"]}
    return kernel_from_data(stored[name])
