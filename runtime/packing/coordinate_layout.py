"""Layout of q and u: indices, names and initial values of coordinates and speeds."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence, ValuesView
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, overload

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.errors import SceneError
from mstmm.ir.hinge_properties import default_coordinates
from mstmm.scene import Hinge, Scene

if TYPE_CHECKING:
    from ..flexible.modal_body import ModalBody


#: Largest number of speeds for which dense matrices are computed: 3 GB a matrix.
_MAX_DENSE_SPEEDS = 20_000
#: Suffix of the hinge that carries the frame of a constraint; no name in a scene has it.
OF_CONSTRAINT = "/constraint"


def check_dense_size(nu: int, what: str) -> None:
    """Raise SceneError if `what`, a dense (nu, nu) matrix, is too large."""
    if nu > _MAX_DENSE_SPEEDS:
        raise SceneError(
            f"{what}: {nu} speeds need {nu**2 * 8 / 1e9:.0f} GB, expected at most "
            f"{_MAX_DENSE_SPEEDS} speeds; use accelerations or simulate, which have no such limit"
        )


@dataclass(frozen=True)
class HingeSlots:
    """Indices, names and units of one hinge's coordinates and speeds.

    Attributes:
        q, u: first index in q and in u.
        quaternion: first quaternion entry within the hinge, None without one.
        rates_are_speeds: whether the speeds are the rates of the coordinates.
        constant_subspace: whether the motion subspace is constant in the outboard body.
        rotation_speeds: whether it is constant and purely rotational.
    """

    name: str
    type: str
    q: int
    u: int
    q_names: tuple[str, ...]
    q_units: tuple[str, ...]
    u_names: tuple[str, ...]
    u_units: tuple[str, ...]
    quaternion: int | None
    rates_are_speeds: bool
    constant_subspace: bool
    rotation_speeds: bool

    @property
    def nq(self) -> int:
        return len(self.q_names)

    @property
    def nu(self) -> int:
        return len(self.u_names)

    @property
    def q_slice(self) -> slice:
        return slice(self.q, self.q + self.nq)

    @property
    def u_slice(self) -> slice:
        return slice(self.u, self.u + self.nu)


@dataclass(frozen=True)
class Group:
    """Hinges that repeat a pattern: a single hinge, or those of a chain.

    Attributes:
        first: number of the first hinge.
        count: number of hinges.
        hinges: slots of the first repeat of the pattern.
        nq, nu: numbers of coordinates and speeds of one repeat.
    """

    first: int
    count: int
    hinges: tuple[HingeSlots, ...]
    nq: int
    nu: int

    @property
    def q(self) -> int:
        return self.hinges[0].q

    @property
    def u(self) -> int:
        return self.hinges[0].u

    def q_starts(self) -> Integers:
        """Index of the first coordinate of every hinge."""
        return self._repeat([h.q for h in self.hinges], self.nq)

    def u_starts(self) -> Integers:
        """Index of the first speed of every hinge."""
        return self._repeat([h.u for h in self.hinges], self.nu)

    def quaternions(self) -> Integers:
        """Index of the first quaternion entry of every hinge that has a quaternion."""
        has_quaternion = np.array([h.quaternion is not None for h in self.hinges])
        first = [h.q + (h.quaternion or 0) for h in self.hinges]
        k = np.arange(self.count)
        return self._repeat(first, self.nq)[has_quaternion[k % len(self.hinges)]]

    def _repeat(self, pattern: Sequence[int], length: int) -> Integers:
        """Indices (count,) of a pattern whose repeats are `length` entries apart."""
        if self.count == 1:
            return np.array(pattern, dtype=np.int64)
        k = np.arange(self.count)
        repeats, member = np.divmod(k, len(self.hinges))
        return np.asarray(np.array(pattern, dtype=np.int64)[member] + repeats * length)


def _user_name(name: str) -> str:
    """Name of a hinge or constraint as the user wrote it."""
    return name.removesuffix(OF_CONSTRAINT)


class Layout:
    """Layout of q (nq,) and u (nu,): the scene's hinges, those of its chains, then the modes.

    Attributes:
        hinges: hinge name -> slots; those of chains are computed on access.
        modal: flexible body -> slots of its modal coordinates.
        internal: numbers of the hinges that belong to sections of flexible bodies or constraints.
        inputs: name of an input or signal -> its number.
    """

    def __init__(
        self,
        scene: Scene,
        groups: tuple[Group, ...],
        nq: int,
        nu: int,
        modal: Mapping[str, HingeSlots] | None = None,
        internal: range = range(0),
        inputs: Iterable[str] = (),
    ) -> None:
        self.groups, self.nq, self.nu = groups, nq, nu
        self.modal: Mapping[str, HingeSlots] = modal or {}
        self.internal = internal
        self.inputs = {name: number for number, name in enumerate(inputs)}
        self._numbers, self._names = scene.hinges, scene.names
        self.hinges: Mapping[str, HingeSlots] = _SlotsByName(self)

    def __len__(self) -> int:
        return len(self._numbers)

    def group(self, hinge: int) -> Group:
        """Group of a hinge, given by its number."""
        return self.groups[bisect_right(self._firsts, hinge) - 1]

    def slots(self, hinge: int) -> HingeSlots:
        """Slots of a hinge, given by its number."""
        group = self.group(hinge)
        if group.count == 1:
            return group.hinges[0]
        repeats, member = divmod(hinge - group.first, len(group.hinges))
        slots = group.hinges[member]
        return HingeSlots(
            self._numbers.name(hinge), slots.type, slots.q + repeats * group.nq,
            slots.u + repeats * group.nu, slots.q_names, slots.q_units, slots.u_names,
            slots.u_units, slots.quaternion, slots.rates_are_speeds, slots.constant_subspace,
            slots.rotation_speeds,
        )  # fmt: skip

    @cached_property
    def _firsts(self) -> list[int]:
        return [group.first for group in self.groups]

    @cached_property
    def q_starts(self) -> Integers:
        """Index of the first coordinate of every hinge."""
        return _concatenate([group.q_starts() for group in self.groups])

    @cached_property
    def u_starts(self) -> Integers:
        """Index of the first speed of every hinge."""
        return _concatenate([group.u_starts() for group in self.groups])

    @property
    def q_names(self) -> list[str]:
        """Names `hinge.coordinate` of all entries of q."""
        return [f"{h.name}.{n}" for h in self.owners for n in h.q_names]

    @property
    def u_names(self) -> list[str]:
        """Names `hinge.speed` of all entries of u."""
        return [f"{h.name}.{n}" for h in self.owners for n in h.u_names]

    @property
    def owners(self) -> Iterator[HingeSlots]:
        """Slots of all owners of coordinates: hinges, curve constraints, flexible bodies."""
        yield from self.hinges.values()
        for number in self.internal:
            slots = self.slots(number)
            if slots.nq:
                yield replace(slots, name=_user_name(slots.name))
        yield from self.modal.values()

    def curve_slots(self, constraint: str) -> HingeSlots:
        """Slots of the curve parameter of a constraint."""
        internal_slots = (self.slots(number) for number in self.internal)
        name = f"{constraint}{OF_CONSTRAINT}"
        return next(slots for slots in internal_slots if slots.name == name)

    def _modal_slots(self, entry: int, quantity: str) -> HingeSlots | None:
        """Slots of the flexible body that owns an entry of "q" or "u"; None if none does."""
        for slots in self.modal.values():
            if 0 <= entry - getattr(slots, quantity) < slots.nq:
                return slots
        return None

    def q_name(self, entry: int) -> str:
        """Name `hinge.coordinate` of an entry of q."""
        slots = self._modal_slots(entry, "q")
        if slots is None:
            slots = self.slots(int(np.searchsorted(self.q_starts, entry, side="right")) - 1)
        return f"{_user_name(slots.name)}.{slots.q_names[entry - slots.q]}"

    def u_name(self, entry: int) -> str:
        """Name `hinge.speed` of an entry of u."""
        slots = self.hinge_of_speed(entry)
        return f"{_user_name(slots.name)}.{slots.u_names[entry - slots.u]}"

    def hinge_of_speed(self, entry: int) -> HingeSlots:
        """Slots of the hinge or flexible body that owns an entry of u."""
        return self._modal_slots(entry, "u") or self.slots(
            int(np.searchsorted(self.u_starts, entry, side="right")) - 1
        )

    @cached_property
    def quaternions(self) -> Integers:
        """Index in q of the first entry of every unit quaternion (w, x, y, z)."""
        return _concatenate([group.quaternions() for group in self.groups])

    @cached_property
    def q_by_unit(self) -> dict[str, Integers]:
        """Unit -> indices of the entries of q that have it, without quaternions."""
        indices: dict[str, list[Integers]] = {}
        for group in self.groups:
            places = group.q_starts()
            for j, hinge in enumerate(group.hinges[: group.count]):
                first, quaternion = places[j :: len(group.hinges)], hinge.quaternion
                for k, unit in enumerate(hinge.q_units):
                    if quaternion is None or not quaternion <= k < quaternion + 4:
                        indices.setdefault(unit, []).append(first + k)
        return self._with_modes(indices, "q")

    @cached_property
    def u_by_unit(self) -> dict[str, Integers]:
        """Unit -> indices of the entries of u that have it."""
        indices: dict[str, list[Integers]] = {}
        for group in self.groups:
            places = group.u_starts()
            for j, hinge in enumerate(group.hinges[: group.count]):
                first = places[j :: len(group.hinges)]
                for k, unit in enumerate(hinge.u_units):
                    indices.setdefault(unit, []).append(first + k)
        return self._with_modes(indices, "u")

    def _with_modes(self, indices: dict[str, list[Integers]], quantity: str) -> dict[str, Integers]:
        """Indices by unit of the hinges joined with those of the modes, in ascending order."""
        for body in self.modal.values():
            start, units = (body.q, body.q_units) if quantity == "q" else (body.u, body.u_units)
            for k, unit in enumerate(units, start):
                indices.setdefault(unit, []).append(np.array([k]))
        return {unit: np.sort(np.concatenate(parts)) for unit, parts in indices.items()}


def _concatenate(parts: list[Integers]) -> Integers:
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)


class StateNames(Sequence[str]):
    """Names of the components of an integrator's state: q, u and possibly the work."""

    def __init__(self, layout: Layout, with_work: bool) -> None:
        self.layout, self.with_work = layout, with_work

    def __len__(self) -> int:
        return self.layout.nq + self.layout.nu + int(self.with_work)

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> list[str]: ...
    def __getitem__(self, index: int | slice) -> str | list[str]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        if not 0 <= index < len(self):
            raise IndexError(index)
        nq, nu = self.layout.nq, self.layout.nu
        if index < nq:
            return f"coordinate {self.layout.q_name(index)}"
        return f"speed {self.layout.u_name(index - nq)}" if index < nq + nu else "work"


class _SlotsByName(Mapping[str, HingeSlots]):
    """Slots by hinge name; names of `[names]` and of flexible bodies are found, but not listed."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout

    def __getitem__(self, name: str) -> HingeSlots:
        layout = self.layout
        for candidate in dict.fromkeys((name, layout._names.of_hinge(name))):
            number = layout._numbers.find(candidate)
            if number is not None and number not in layout.internal:
                return layout.slots(number)
        return layout.modal[name]

    def __iter__(self) -> Iterator[str]:
        internal = self.layout.internal
        for number, name in enumerate(self.layout._numbers.names()):
            if number not in internal:
                yield name

    def __len__(self) -> int:
        return len(self.layout) - len(self.layout.internal)

    def values(self) -> ValuesView[HingeSlots]:
        """Slots of all hinges; faster than a lookup of each name."""
        return _SlotsView(self)


class _SlotsView(ValuesView[HingeSlots]):
    """Slots in the order of the hinges."""

    def __init__(self, slots: _SlotsByName) -> None:
        super().__init__(slots)
        self.layout = slots.layout

    def __iter__(self) -> Iterator[HingeSlots]:
        layout = self.layout
        for number in range(layout.internal.start):
            yield layout.slots(number)
        for number in range(layout.internal.stop, len(layout)):
            yield layout.slots(number)


# --- initial state --------------------------------------------------------------------------------


def start_values(
    scene: Scene, layout: Layout, flexible: Mapping[str, ModalBody] | None = None
) -> tuple[Array, Array]:
    """Initial (q, u) of the scene; driven coordinates have the values of `initial`."""
    q, u = np.zeros(layout.nq), np.zeros(layout.nu)
    for group in layout.groups:
        for k, slots in enumerate(group.hinges):
            hinge_q, hinge_u = _hinge_values(scene.hinges[group.first + k], slots)
            if group.count == 1:
                q[slots.q_slice], u[slots.u_slice] = hinge_q, hinge_u
                continue
            for target, first, values in (
                (q, group.q_starts(), hinge_q), (u, group.u_starts(), hinge_u)
            ):  # fmt: skip
                if len(values):
                    repeats = first[k :: len(group.hinges)]
                    target[repeats[:, None] + np.arange(len(values))] = values
    for name, body in (flexible or {}).items():
        slots = layout.modal[name]
        if len(body.eta):
            q[slots.q_slice] = body.eta
        if len(body.etad):
            u[slots.u_slice] = body.etad
    return q, u


def _hinge_values(hinge: Hinge, slots: HingeSlots) -> tuple[Array, Array]:
    """Initial (q, u) of one hinge."""
    q, u = np.zeros(slots.nq), np.zeros(slots.nu)
    q[:] = default_coordinates(slots.nq, slots.quaternion)
    if hinge.initial is not None and hinge.initial.q:
        q[:] = hinge.initial.q
    if hinge.initial is not None and hinge.initial.u:
        u[:] = hinge.initial.u
    return q, u
