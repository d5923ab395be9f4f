"""Hinge laws -> records of the engine: which law kernel acts on which speeds, with what numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mstmm.scene import Hinge, LawEntry

from . import prebuilt
from .layout import HingeSlots
from .placement import law_axes
from .values import Values

if TYPE_CHECKING:
    from .pack import Packed

#: Bounds that no coordinate reaches, for a stop on one side only.
_FAR = 1e300


def pack_laws(packed: Packed, values: Values) -> int:
    """Fill the model's laws; returns how many twist memories they need."""
    records: list[dict[str, Any]] = []
    first_twist, twists = len(packed.releases), 0
    for i, link in enumerate(packed.topology.links):
        hinge = packed.scene.hinge[link.hinge]
        slots = packed.layout.hinges[hinge.name]
        if slots.nu == 0 or (hinge.type == "fixed"):
            continue
        if slots.quaternion is None or hinge.builtin is None:
            records += _coordinates(packed, values, i, hinge, slots)
            continue
        found = _rotational(packed, values, i, hinge, slots, first_twist + twists)
        twists += sum(record["kind"] for record in found)
        records += found
    array = packed.ffi.new("mstmm_law[]", max(1, len(records)))
    for target, record in zip(array, records, strict=False):
        for key, value in record.items():
            setattr(target, key, value)
    packed.kept.append(array)
    packed.model.laws, packed.model.n_laws = array, len(records)
    return twists


def _acts(entry: LawEntry) -> bool:
    return bool(entry.stiffness or entry.damping or not entry.effort.is_zero)


def _record(packed: Packed, p: list[float], effort: list[int]) -> dict[str, Any]:
    ffi = packed.ffi
    arrays = ffi.new("real[]", p), ffi.new("int[]", effort)
    packed.kept += arrays
    return {"p": arrays[0], "effort": arrays[1], "axes": ffi.NULL, "twist": -1, "kind": 0}


def _coordinates(
    packed: Packed, values: Values, body: int, hinge: Hinge, slots: HingeSlots
) -> list[dict[str, Any]]:
    """One record per coordinate on which something acts."""
    functions = prebuilt.element("sweep", "laws").functions
    records = []
    for k in range(slots.nu):
        entry = hinge.law.entry(k)
        full = entry.friction.acts or entry.limits.acts
        if not (_acts(entry) or full):
            continue
        p = [entry.stiffness, entry.rest, entry.damping]
        p += _full(entry) if full else []
        record = _record(packed, p, [values.place(entry.effort, hinge)])
        record |= {"body": body, "coordinate": k, "speed": k, "n": 1}
        record["evaluate"] = functions["full" if full else "linear"]
        records.append(record)
    return records


def _full(entry: LawEntry) -> list[float]:
    friction, limits = entry.friction, entry.limits
    return [
        friction.coulomb, friction.static, friction.stribeck_velocity,
        friction.regularisation_velocity,
        -_FAR if limits.lower is None else limits.lower,
        _FAR if limits.upper is None else limits.upper,
        limits.stiffness, limits.damping,
    ]  # fmt: skip


def _rotational(
    packed: Packed, values: Values, body: int, hinge: Hinge, slots: HingeSlots, twist: int
) -> list[dict[str, Any]]:
    """Law of a hinge with a quaternion: springs from a potential, dampers, efforts; friction."""
    functions = prebuilt.element("sweep", "laws").functions
    entries = [hinge.law.entry(k) for k in range(slots.nu)]
    records = []
    if any(_acts(entry) for entry in entries):
        translations, rotations = entries[:-3], entries[-3:]
        p = [getattr(e, key) for key in ("stiffness", "rest", "damping") for e in translations]
        p += [e.stiffness for e in rotations] + [0.0] + [e.damping for e in rotations]
        record = _record(packed, p, [values.place(e.effort, hinge) for e in entries])
        axes = packed.ffi.new("real[]", [x for row in law_axes(hinge) for x in row])
        packed.kept.append(axes)
        record |= {"body": body, "coordinate": 0, "speed": 0, "n": slots.nu, "kind": 1}
        record |= {"axes": axes, "twist": twist}
        record["evaluate"] = functions["six" if translations else "rotation"]
        records.append(record)
    for k, entry in enumerate(entries):
        if entry.friction.acts:
            p = [0.0, 0.0, 0.0, *_full(entry)]
            record = _record(packed, p, [-1])
            record |= {"body": body, "coordinate": 0, "speed": k, "n": 1}
            records.append(record | {"evaluate": functions["full"]})
    return records
