"""Hinge laws -> records of the engine: which law kernel acts on which speeds, with what numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.expression.expression import Expression, number
from mstmm.ir.facts import builtin_hinges
from mstmm.scene import Hinge, LawEntry
from mstmm.scene.checks.topology import Run
from mstmm.scene.tables.chain import Chain
from mstmm.scene.tables.hinge_frames import twist_axes

from ..kernels import prebuilt
from ..kernels.records import Records
from .layout import HingeSlots
from .values import Values

if TYPE_CHECKING:
    from .packed import Packed

Array = NDArray[Any]

_NOTHING = number(0)

#: Bounds that no coordinate reaches, for a stop on one side only.
_FAR = 1e300


Record = dict[str, Any]


def pack_laws(packed: Packed, values: Values) -> int:
    """Fill the model's laws; returns how many twist memories they need.

    Of a chain the laws of one period of its pattern are made and copied to all its members.
    """
    maker = _Laws(packed, values)
    parts: list[tuple[list[list[Record]], Run]] = []
    for run in packed.topology.runs:
        chain = _chain_of(packed, run)
        period = 1 if chain is None else min(chain.period, run.count)
        pattern = [maker.of(run, k) for k in range(period)]
        if any(pattern):
            parts.append((pattern, run))
    counts = [_count(pattern, run.count) for pattern, run in parts]
    records = Records(packed.ffi, "mstmm_law", sum(counts))
    packed.kept.append(records)
    first, twists = 0, 0
    for (pattern, run), count in zip(parts, counts, strict=True):
        twists += maker.fill(records, slice(first, first + count), pattern, run, twists)
        first += count
    packed.model.laws, packed.model.n_laws = records.array, records.count
    return twists


def _chain_of(packed: Packed, run: Run) -> Chain | None:
    scene = packed.scene
    if run.body < len(scene.body):
        return None
    return scene.chain[scene.bodies.member(run.body)[0]]


def _count(pattern: list[list[Record]], members: int) -> int:
    """Laws of so many members that repeat a pattern."""
    repeats, rest = divmod(members, len(pattern))
    return repeats * sum(map(len, pattern)) + sum(map(len, pattern[:rest]))


class _Laws:
    """Makes records of laws, those of a chain from its pattern."""

    def __init__(self, packed: Packed, values: Values) -> None:
        self.packed, self.values = packed, values

    def of(self, run: Run, k: int) -> list[Record]:
        """Records of the hinge of member k."""
        number = run.hinge + k
        hinge, slots = self.packed.scene.hinges[number], self.packed.layout.slots(number)
        if slots.nu == 0 or hinge.is_weld:
            return []
        if slots.quaternion is None or not _is_known(hinge):
            return _coordinates(self.packed, hinge, slots)
        return _rotational(self.packed, hinge, slots)

    def fill(
        self, records: Records, places: slice, pattern: list[list[Record]], run: Run, twists: int
    ) -> int:
        """Records of all members of a run; returns how many twist memories they take."""
        flat = [record for member in pattern for record in member]
        if run.count == 1:
            return self._fill_one(records, places.start, flat, run, twists)
        prototypes = Records(self.packed.ffi, "mstmm_law", len(flat))
        for target, record in zip(prototypes.array, flat, strict=False):
            for key, value in record.items():
                if key != "effort":
                    setattr(target, key, value)
        count = places.stop - places.start
        repeats, which = np.divmod(np.arange(count), len(flat))
        records.copy(places, prototypes, which)
        member = np.repeat(np.arange(len(pattern)), [len(one) for one in pattern])
        members = repeats * len(pattern) + member[which]
        records.column("body")[places] = run.place + members
        turning = records.column("kind")[places] == 1
        first = len(self.packed.releases) + twists
        twist = np.where(turning, first + np.cumsum(turning) - 1, -1)
        records.column("twist")[places] = twist
        self._efforts(records.column("effort")[places], [r["effort"] for r in flat], members, run)
        return int(turning.sum())

    def _fill_one(
        self, records: Records, place: int, flat: list[Record], run: Run, twists: int
    ) -> int:
        """The same for a body of its own, record by record."""
        hinge, first = self.packed.scene.hinges[run.hinge], len(self.packed.releases) + twists
        turning = 0
        for target_place, record in enumerate(flat, place):
            target = records.array[target_place]
            for key, value in record.items():
                if key != "effort":
                    setattr(target, key, value)
            places = [self.values.place(effort, hinge) for effort in record["effort"]]
            array = self.packed.ffi.new("int[]", places)
            self.packed.kept.append(array)
            target.effort, target.body = array, run.place
            target.twist = first + turning if record["kind"] == 1 else -1
            turning += record["kind"]
        return turning

    def _efforts(
        self, pointers: Array, efforts: list[list[Expression]], members: Array, run: Run
    ) -> None:
        """Places of the efforts' values; those that read the hinge's own q and u, each its own."""
        shared: dict[int, int] = {}
        for row, member in enumerate(members.tolist()):
            which = row % len(efforts)
            if which not in shared:
                hinge = self.packed.scene.hinges[run.hinge + member]
                places = [self.values.place(effort, hinge) for effort in efforts[which]]
                array = self.packed.ffi.new("int[]", places)
                self.packed.kept.append(array)
                address = int(self.packed.ffi.cast("uintptr_t", array))
                if any(_reads_its_own(effort) for effort in efforts[which]):
                    pointers[row] = address
                    continue
                shared[which] = address
            if len(shared) == len(efforts):
                break
        for which, address in shared.items():
            pointers[which :: len(efforts)] = address


def _reads_its_own(effort: Expression) -> bool:
    """True where an expression has a name that means something else in every hinge."""
    return any(len(name.parts) == 1 and name.text != "t" for name in effort.names)


def _acts(entry: LawEntry) -> bool:
    return bool(entry.stiffness or entry.damping or not entry.effort.is_zero)


def _record(packed: Packed, p: list[float], effort: list[Expression]) -> Record:
    array = packed.ffi.new("real[]", p)
    packed.kept.append(array)
    return {"p": array, "effort": effort, "axes": packed.ffi.NULL, "kind": 0}


def _coordinates(packed: Packed, hinge: Hinge, slots: HingeSlots) -> list[Record]:
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
        record = _record(packed, p, [entry.effort])
        record |= {"coordinate": k, "speed": k, "n": 1}
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


def _is_known(hinge: Hinge) -> bool:
    """Whether the law's kernels know where its rotation stands in q and u."""
    return hinge.facts is not None and hinge.facts.runs_as in builtin_hinges()


def _rotational(packed: Packed, hinge: Hinge, slots: HingeSlots) -> list[Record]:
    """Law of a hinge with a quaternion: springs from a potential, dampers, efforts; friction."""
    functions = prebuilt.element("sweep", "laws").functions
    entries = [hinge.law.entry(k) for k in range(slots.nu)]
    records = []
    if any(_acts(entry) for entry in entries):
        translations, rotations = entries[:-3], entries[-3:]
        p = [getattr(e, key) for key in ("stiffness", "rest", "damping") for e in translations]
        p += [e.stiffness for e in rotations] + [0.0] + [e.damping for e in rotations]
        record = _record(packed, p, [e.effort for e in entries])
        axes = packed.ffi.new("real[]", [x for row in twist_axes(hinge) for x in row])
        packed.kept.append(axes)
        record |= {"coordinate": 0, "speed": 0, "n": slots.nu, "kind": 1}
        record["axes"] = axes
        record["evaluate"] = functions["six" if translations else "rotation"]
        records.append(record)
    for k, entry in enumerate(entries):
        if entry.friction.acts:
            p = [0.0, 0.0, 0.0, *_full(entry)]
            record = _record(packed, p, [_NOTHING])
            record |= {"coordinate": 0, "speed": k, "n": 1}
            records.append(record | {"evaluate": functions["full"]})
    return records
