"""Generated elements by name, read from JSON, so that no derivation is repeated."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from mstmm.errors import ElementError

if TYPE_CHECKING:
    from mstmm.ir.element_spec import ElementSpec

KINDS = ("hinge", "body", "force", "classical", "sweep")


@dataclass(frozen=True)
class Entry:
    """Element in a listing: names of its quantities have units in brackets."""

    kind: str
    name: str
    title: str
    coordinates: tuple[str, ...] = ()
    speeds: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        return dict(vars(self))


def name_with_unit(name: str, unit: str) -> str:
    """Name with its unit, such as "angle [rad]"; without brackets if dimensionless."""
    return f"{name} [{unit}]" if unit else name


def builtin_entries(kind: str) -> list[Entry]:
    """Built-in elements of one kind."""
    return [entry for entry in _catalogue() if entry.kind == kind]


@cache
def _catalogue() -> tuple[Entry, ...]:
    return tuple(
        _entry_from_data(data) for data in json.loads(generated_text("catalogue", ".json") or "[]")
    )


def entry_from_spec(spec: ElementSpec) -> Entry:
    """Entry of an element from its specification."""
    groups = (spec.coordinates, spec.speeds, spec.parameters)
    coordinates, speeds, parameters = (
        tuple(name_with_unit(p.name, p.unit) for p in g) for g in groups
    )
    return Entry(spec.kind, spec.name, spec.title, coordinates, speeds, parameters, spec.sources)


def _entry_from_data(data: dict[str, Any]) -> Entry:
    groups = {
        group: tuple(name_with_unit(name, unit) for name, unit in data[group].items())
        for group in ("coordinates", "speeds", "parameters")
    }
    return Entry(
        data["kind"], data["name"], data["title"], sources=tuple(data["sources"]), **groups
    )


def generated_text(full_name: str, ending: str) -> str | None:
    """Text of a generated file, such as ("hinge_pin", ".c"); None if there is none."""
    if not full_name.replace("_", "").isalnum():
        return None
    file = files("mstmm.generated").joinpath(full_name + ending)
    return file.read_text(encoding="utf-8") if file.is_file() else None


@cache
def generated_specs() -> dict[tuple[str, str], ElementSpec]:
    """All generated elements with their kernels, by (kind, name)."""
    from mstmm.ir.element_spec import element_from_json

    texts = {(e.kind, e.name): generated_text(f"{e.kind}_{e.name}", ".json") for e in _catalogue()}
    return {key: element_from_json(data) for key, data in texts.items() if data is not None}


def element_index() -> dict[str, tuple[str, str]]:
    """Index of built-in and stored elements: full name (hinge_pin) -> (kind, name)."""
    from mstmm.runtime.kernels import kernel_store

    built_in = [(e.kind, e.name) for kind in KINDS for e in builtin_entries(kind)]
    names = {
        f"{kind}_{name}": (kind, name)
        for kind, name in [*built_in, *sorted(kernel_store.all_specs())]
    }
    return names | {"hinge_elastic": ("hinge", "free")}  # same motion; its law is in sweep_laws


def find_element(name: str) -> tuple[str, str]:
    """Find (kind, name) of an element by its full name "hinge_pin", or by "pin".

    The short name means the first kind that has it.  Raises ElementError, with the nearest name, if
    there is no such element.
    """
    from mstmm.scene.validators.validation_messages import did_you_mean

    names = element_index()
    for full_name in (name, *(f"{kind}_{name}" for kind in KINDS)):
        if full_name in names:
            return names[full_name]
    hint = did_you_mean(name, [*names, *(short_name for _, short_name in names.values())])
    if "did you mean" not in hint:
        hint = "; mstmm list shows all elements"
    raise ElementError(f'element "{name:.60}": there is no such element{hint}')
