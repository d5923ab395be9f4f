"""Where a hinge's coordinates and speeds stand in q and u: hinges in the scene's order."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence, ValuesView
from dataclasses import dataclass, replace
from functools import cached_property
from typing import overload

import numpy as np

from mstmm.array_validation import Integers
from mstmm.errors import SceneError
from mstmm.scene import Scene

#: Speeds up to which dense matrices are made: 3 GB a matrix.
_DENSE = 20_000
#: Behind the name of a constraint, that of what holds its frame: no scene has such a hinge.
OF_CONSTRAINT = "/constraint"


def check_dense_size(nu: int, what: str) -> None:
    """SceneError if `what`, a dense matrix with a row and a column per speed, is too large."""
    if nu > _DENSE:
        raise SceneError(
            f"{what} of {nu} speeds would have {nu**2 * 8 / 1e9:.0f} GB; it is made for up to "
            f"{_DENSE} speeds (accelerations and simulate have no such limit)"
        )


@dataclass(frozen=True)
class HingeSlots:
    """Place and names of one hinge's coordinates and speeds."""

    name: str
    type: str
    q: int
    u: int
    q_names: tuple[str, ...]
    q_units: tuple[str, ...]
    u_names: tuple[str, ...]
    u_units: tuple[str, ...]
    quaternion: int | None  # first quaternion entry within the hinge
    straight: bool  # the speeds are the rates of the coordinates
    steady: bool  # the motions are the same in every position, seen from the outboard body
    turning: bool  # and they are turns alone

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
    """Hinges that repeat a pattern: one hinge of its own, or those of a chain.

    `hinges` are the pattern with its places in q and u, `nq` and `nu` its length; `first` is the
    number of the first hinge, `count` how many there are.
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

    def q_places(self) -> Integers:
        """First coordinate of every hinge."""
        return self._spread([h.q for h in self.hinges], self.nq)

    def u_places(self) -> Integers:
        """First speed of every hinge."""
        return self._spread([h.u for h in self.hinges], self.nu)

    def quaternions(self) -> Integers:
        """First quaternion entry of every hinge that has one."""
        there = np.array([h.quaternion is not None for h in self.hinges])
        first = [h.q + (h.quaternion or 0) for h in self.hinges]
        k = np.arange(self.count)
        return self._spread(first, self.nq)[there[k % len(self.hinges)]]

    def _spread(self, pattern: Sequence[int], length: int) -> Integers:
        if self.count == 1:
            return np.array(pattern, dtype=np.int64)
        k = np.arange(self.count)
        repeats, which = np.divmod(k, len(self.hinges))
        return np.asarray(np.array(pattern, dtype=np.int64)[which] + repeats * length)


def _shown(name: str) -> str:
    """The name under which users know what has coordinates."""
    return name.removesuffix(OF_CONSTRAINT)


class Layout:
    """Layout of q (nq) and u (nu) by hinge: the scene's hinges, then those of its chains.

    `hinges` gives the slots of a hinge by its name; of chains they are made when asked for.
    `inputs` are the places of inputs and signals among them by their names.
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
        #: Slots of the modal coordinates of flexible bodies, behind those of all hinges.
        self.modal: Mapping[str, HingeSlots] = modal or {}
        #: Numbers of hinges that stand for sections of flexible bodies.
        self.internal = internal
        self.inputs = {name: place for place, name in enumerate(inputs)}
        self._numbers, self._names = scene.hinges, scene.names
        self.hinges: Mapping[str, HingeSlots] = _ByName(self)

    def __len__(self) -> int:
        return len(self._numbers)

    def group(self, hinge: int) -> Group:
        """The group to which the hinge of this number belongs."""
        return self.groups[bisect_right(self._firsts, hinge) - 1]

    def slots(self, hinge: int) -> HingeSlots:
        """Slots of the hinge of this number."""
        group = self.group(hinge)
        k = hinge - group.first
        if group.count == 1:
            return group.hinges[0]
        repeats, which = divmod(k, len(group.hinges))
        one = group.hinges[which]
        return HingeSlots(
            self._numbers.name(hinge), one.type, one.q + repeats * group.nq,
            one.u + repeats * group.nu, one.q_names, one.q_units, one.u_names, one.u_units,
            one.quaternion, one.straight, one.steady, one.turning,
        )  # fmt: skip

    @cached_property
    def _firsts(self) -> list[int]:
        return [group.first for group in self.groups]

    @cached_property
    def q_places(self) -> Integers:
        """First coordinate of every hinge, by number."""
        return _joined([group.q_places() for group in self.groups])

    @cached_property
    def u_places(self) -> Integers:
        """First speed of every hinge, by number."""
        return _joined([group.u_places() for group in self.groups])

    @property
    def q_names(self) -> list[str]:
        """`hinge.coordinate` for every entry of q."""
        return [f"{h.name}.{n}" for h in self.owners for n in h.q_names]

    @property
    def u_names(self) -> list[str]:
        """`hinge.speed` for every entry of u."""
        return [f"{h.name}.{n}" for h in self.owners for n in h.u_names]

    @property
    def owners(self) -> Iterator[HingeSlots]:
        """Slots of everything that has coordinates, in their order: hinges, constraints with
        coordinates of their own by their names, flexible bodies."""
        yield from self.hinges.values()
        for number in self.internal:
            slots = self.slots(number)
            if slots.nq:
                yield replace(slots, name=_shown(slots.name))
        yield from self.modal.values()

    def along(self, constraint: str) -> HingeSlots:
        """Slots of a point's way along the curve of a constraint."""
        ways = (self.slots(number) for number in self.internal)
        return next(one for one in ways if one.name == f"{constraint}{OF_CONSTRAINT}")

    def _modal_at(self, entry: int, letter: str) -> HingeSlots | None:
        """The flexible body to which an entry of q or u belongs."""
        for slots in self.modal.values():
            if 0 <= entry - getattr(slots, letter) < slots.nq:
                return slots
        return None

    def q_name(self, entry: int) -> str:
        """`hinge.coordinate` of one entry of q."""
        slots = self._modal_at(entry, "q")
        if slots is None:
            slots = self.slots(int(np.searchsorted(self.q_places, entry, side="right")) - 1)
        return f"{_shown(slots.name)}.{slots.q_names[entry - slots.q]}"

    def u_name(self, entry: int) -> str:
        """`hinge.speed` of one entry of u."""
        slots = self.hinge_of_speed(entry)
        return f"{_shown(slots.name)}.{slots.u_names[entry - slots.u]}"

    def hinge_of_speed(self, entry: int) -> HingeSlots:
        """The hinge, or flexible body, to which an entry of u belongs."""
        return self._modal_at(entry, "u") or self.slots(
            int(np.searchsorted(self.u_places, entry, side="right")) - 1
        )

    @cached_property
    def quaternions(self) -> Integers:
        """First index in q of every unit quaternion (w, x, y, z)."""
        return _joined([group.quaternions() for group in self.groups])

    @cached_property
    def q_by_unit(self) -> dict[str, Integers]:
        """Unit -> entries of q that have it, those of quaternions left out."""
        found: dict[str, list[Integers]] = {}
        for group in self.groups:
            places = group.q_places()
            for j, hinge in enumerate(group.hinges[: group.count]):
                first, turn = places[j :: len(group.hinges)], hinge.quaternion
                for k, unit in enumerate(hinge.q_units):
                    if turn is None or not turn <= k < turn + 4:
                        found.setdefault(unit, []).append(first + k)
        return self._with_modes(found, "q")

    @cached_property
    def u_by_unit(self) -> dict[str, Integers]:
        """Unit -> entries of u that have it."""
        found: dict[str, list[Integers]] = {}
        for group in self.groups:
            places = group.u_places()
            for j, hinge in enumerate(group.hinges[: group.count]):
                first = places[j :: len(group.hinges)]
                for k, unit in enumerate(hinge.u_units):
                    found.setdefault(unit, []).append(first + k)
        return self._with_modes(found, "u")

    def _with_modes(self, found: dict[str, list[Integers]], kind: str) -> dict[str, Integers]:
        """The entries found of hinges joined with those of flexible bodies."""
        for body in self.modal.values():
            start, units = (body.q, body.q_units) if kind == "q" else (body.u, body.u_units)
            for k, unit in enumerate(units, start):
                found.setdefault(unit, []).append(np.array([k]))
        return {unit: np.sort(np.concatenate(parts)) for unit, parts in found.items()}


def _joined(parts: list[Integers]) -> Integers:
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)


class StateNames(Sequence[str]):
    """What the components of an integrator's state are: q, u and perhaps the work."""

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


class _ByName(Mapping[str, HingeSlots]):
    """Slots by the hinge's name, also that of `[names]`; those of a flexible body by its name,
    though not listed."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout

    def __getitem__(self, name: str) -> HingeSlots:
        layout = self.layout
        for one in dict.fromkeys((name, layout._names.of_hinge(name))):
            number = layout._numbers.find(one)
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
        """All slots; faster than by their names."""
        return _Values(self)


class _Values(ValuesView[HingeSlots]):
    """Slots in the order of the hinges."""

    def __init__(self, slots: _ByName) -> None:
        super().__init__(slots)
        self.layout = slots.layout

    def __iter__(self) -> Iterator[HingeSlots]:
        layout = self.layout
        for number in range(layout.internal.start):
            yield layout.slots(number)
        for number in range(layout.internal.stop, len(layout)):
            yield layout.slots(number)
