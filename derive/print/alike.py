"""Entries that are computed alike, as a loop over pairs of them: less code, two numbers at a time.

A straight-line kernel may say the same for every entry along an axis of an output: for each of the
six components of a load, say.  Such entries are found to be copies of the first that move in
arrays by one place, or it is an error to ask for this; they are printed once, in GNU C vectors of
two.  What is the same for all of them stands before the loop.  Every operation is the kernel's own,
so that the numbers are those of the straight line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from mstmm.ir import (
    OPERATIONS,
    Assign,
    Element,
    KernelIR,
    Operand,
    Port,
    Store,
    Temporary,
)

#: (element, kernel) -> (output, axis along which its entries are alike), in the order in which they
#: are computed; what an output holds is read from there by those behind it.
ALIKE: dict[tuple[str, str], tuple[tuple[str, int], ...]] = {
    ("frames", "tangent_carry"): (("T", 1), ("S_I", 0)),
    ("frames", "tangent_known"): (("e_S", 0), ("e_b", 0)),
    **{(f"generic{n}", "tangent_rows"): (("K", 1), ("right", 1)) for n in range(1, 7)},
    **{(f"generic{n}", "tangent_reduce"): (("gain", 1), ("V", 1), ("S", 1)) for n in range(1, 7)},
}

#: What a lane's value is: the same operand in every lane, or that of each lane in turn.
_Lanes = tuple[Operand, ...]


@dataclass(frozen=True)
class Value:
    """A number of every lane: `op` over `args`, or (no op) the entry of a port at `place`, which
    moves along `axis`."""

    number: int
    op: str
    args: tuple[Value | Operand, ...]
    place: Element | None = None
    axis: int = 0


@dataclass
class Loop:
    """Entries of `port` along `axis`: what is shared, values in order, what is stored where."""

    port: Port
    axis: int
    shared: list[int] = field(default_factory=list)
    values: list[Value] = field(default_factory=list)
    stores: list[tuple[tuple[int, ...], Value]] = field(default_factory=list)

    @property
    def taken_off(self) -> dict[int, Value]:
        """Values that are but added to the port and are the opposite of another: which one."""
        used = {a.number for v in self.values for a in v.args if isinstance(a, Value)}
        added = (v for _, v in self.stores) if self.port.accumulate else ()
        return {
            value.number: first
            for value in added
            for first in value.args[:1]
            if value.op == "neg" and value.number not in used and isinstance(first, Value)
        }

    @property
    def count(self) -> int:
        """Number of entries along the axis."""
        extent = self.port.shape[self.axis]
        assert isinstance(extent, int)
        return extent


class Alike:
    """The loops of one kernel, and the statements behind them."""

    def __init__(self, kernel: KernelIR, asked: Sequence[tuple[str, int]]) -> None:
        if kernel.size_symbol is not None:
            raise ValueError(f"{kernel.name}: a kernel of run-time size has loops of its own")
        self.kernel = kernel
        self.assigned = {s.number: s for s in kernel.statements if isinstance(s, Assign)}
        self.ports = {port.name: port for port in kernel.outputs}
        self.kept: dict[Operand, Element] = {}
        self.loops = [self._loop(self.ports[name], axis) for name, axis in asked]
        looped = {name for name, _ in asked}
        others = [s for s in kernel.statements if not isinstance(s, Assign)]
        if not all(isinstance(s, Store) for s in others):
            raise ValueError(f"{kernel.name}: a guard among loops")
        self.others = [s for s in others if isinstance(s, Store) and s.port not in looped]

    def needed(self, operands: Sequence[Operand]) -> list[Assign]:
        """What operands of the straight line are made of, in its order, kept outputs aside."""
        found: set[int] = set()
        stack = list(operands)
        while stack:
            operand = stack.pop()
            if not isinstance(operand, Temporary) or operand in self.kept:
                continue
            if operand.number not in found:
                found.add(operand.number)
                stack.extend(self.assigned[operand.number].args)
        return [s for number, s in self.assigned.items() if number in found]

    def read(self, operand: Operand) -> Operand:
        """The entry of an output where an operand is kept."""
        return self.kept.get(operand, operand)

    def _loop(self, port: Port, axis: int) -> Loop:
        stored = {s.index: s.value for s in self.kernel.statements
                  if isinstance(s, Store) and s.port == port.name}  # fmt: skip
        loop = _Builder(self, Loop(port, axis))
        for index in stored:
            if index[axis] == 0:
                lanes = tuple(
                    stored[(*index[:axis], k, *index[axis + 1 :])] for k in range(loop.loop.count)
                )
                loop.store(index, lanes)
        if not port.accumulate:
            self.kept |= {
                value: Element(port.name, index)
                for index, value in stored.items()
                if isinstance(value, Temporary)
            }
        return loop.loop


class _Builder:
    """One loop as it grows."""

    def __init__(self, whole: Alike, loop: Loop) -> None:
        self.whole, self.loop = whole, loop
        self.known: dict[_Lanes, Value] = {}
        self.like: dict[tuple[Operand, Operand, int], bool] = {}

    def store(self, index: tuple[int | str, ...], lanes: _Lanes) -> None:
        found = self.value(lanes)
        if not isinstance(found, Value):
            raise self.error(f"{self.loop.port.name}{list(index)} is the same in every lane")
        self.loop.stores.append((tuple(int(entry) for entry in index), found))

    def error(self, text: str) -> ValueError:
        return ValueError(f"{self.whole.kernel.name}: {text}")

    def value(self, lanes: _Lanes) -> Value | Operand:
        """What these operands, one a lane, are."""
        if all(lane == lanes[0] for lane in lanes):
            return self.shared(lanes[0])
        found = self.known.get(lanes)
        if found is None:
            found = self.known[lanes] = self._made(lanes)
            self.loop.values.append(found)
        return found

    def shared(self, operand: Operand) -> Operand:
        operand = self.whole.read(operand)
        if isinstance(operand, Temporary) and operand.number not in self.loop.shared:
            self.loop.shared.append(operand.number)
        return operand

    def _made(self, lanes: _Lanes) -> Value:
        number = len(self.loop.values)
        places = [self.whole.read(lane) for lane in lanes]
        axis = _moves(places)
        if axis is not None:
            assert isinstance(places[0], Element)
            return Value(number, "", (), places[0], axis)
        if not all(self.alike(lanes[0], lane, k) for k, lane in enumerate(lanes)):
            raise self.error(f"entries of {self.loop.port.name} are not computed alike")
        rows = [self._args(lanes[0], lane, k) for k, lane in enumerate(lanes)]
        args = tuple(self.value(column) for column in zip(*rows, strict=True))
        first = lanes[0]
        assert isinstance(first, Temporary)
        return Value(len(self.loop.values), self.whole.assigned[first.number].op, args)

    def _args(self, first: Operand, other: Operand, k: int) -> tuple[Operand, ...]:
        """Operands of lane k in the order of those of the first."""
        assert isinstance(first, Temporary) and isinstance(other, Temporary)
        mine, others = (self.whole.assigned[o.number].args for o in (first, other))
        if all(self.alike(a, b, k) for a, b in zip(mine, others, strict=True)):
            return others
        return others[::-1]

    def alike(self, first: Operand, other: Operand, k: int) -> bool:
        """Whether an operand of lane k is made as that of the first lane is."""
        key = first, other, k
        if key not in self.like:
            self.like[key] = first == other or self._alike(first, other, k)
        return self.like[key]

    def _alike(self, first: Operand, other: Operand, k: int) -> bool:
        places = [self.whole.read(operand) for operand in (first, other)]
        if _moves([places[0], *[None] * (k - 1), places[1]]) is not None:
            return True
        if not isinstance(first, Temporary) or not isinstance(other, Temporary):
            return False
        mine, others = (self.whole.assigned[o.number] for o in (first, other))
        row = OPERATIONS[mine.op]
        if (
            mine.op != others.op
            or row.truth
            or row.conditions
            or not (row.sign or mine.op == "neg")
        ):
            return False
        orders = [others.args, others.args[::-1]] if row.commutative else [others.args]
        return any(
            all(self.alike(a, b, k) for a, b in zip(mine.args, order, strict=True))
            for order in orders
        )


def _moves(places: Sequence[Operand | None]) -> int | None:
    """The axis along which entries of a port move by one from lane to lane (None: not known)."""
    first = places[0]
    if not isinstance(first, Element):
        return None
    for axis in range(len(first.index)):
        before, start, after = first.index[:axis], first.index[axis], first.index[axis + 1 :]
        assert isinstance(start, int)
        wanted = (Element(first.port, (*before, start + k, *after)) for k in range(len(places)))
        if all(p is None or p == w for p, w in zip(places, wanted, strict=True)):
            return axis
    return None
