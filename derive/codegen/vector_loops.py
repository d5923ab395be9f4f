"""Vector loops over output entries with equal computations, two entries at a time.

A straight-line kernel may repeat one computation for every entry along an axis of an output, such
as the six components of a load.  The entries must be copies of the first whose operands move by one
entry in their arrays; otherwise the request is an error.  They are printed once, in GNU C vectors
of two.  Values shared by all entries come before the loop.  Operations are unchanged, so that
results equal those of the straight line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from mstmm.ir import OPERATIONS, Assign, Element, KernelIR, Operand, Port, Store, Temporary

#: (element, kernel) -> (output, axis along which all entries have equal computations), in the order
#: in which they are computed; later outputs read the values of earlier ones.
VECTORIZED_OUTPUTS: dict[tuple[str, str], tuple[tuple[str, int], ...]] = {
    ("frames", "tangent_carry"): (("T", 1), ("S_I", 0)),
    ("frames", "tangent_known_load"): (("e_S", 0), ("e_b", 0)),
    **{(f"generic{n}", "tangent_rows"): (("K", 1), ("right", 1)) for n in range(1, 7)},
    **{(f"generic{n}", "tangent_reduce"): (("gain", 1), ("V", 1), ("S", 1)) for n in range(1, 7)},
}

#: Operand of each lane.
_LaneOperands = tuple[Operand, ...]


@dataclass(frozen=True)
class LaneValue:
    """Value in every lane: `op` of `args`, or without `op` the entry `entry` of a port.

    The entry moves along `axis` from lane to lane."""

    number: int
    op: str
    args: tuple[LaneValue | Operand, ...]
    entry: Element | None = None
    axis: int = 0


@dataclass
class VectorLoop:
    """Loop over entries of `port` along `axis`: shared temporaries, values in order, stores."""

    port: Port
    axis: int
    shared_temporaries: list[int] = field(default_factory=list)
    values: list[LaneValue] = field(default_factory=list)
    stores: list[tuple[tuple[int, ...], LaneValue]] = field(default_factory=list)

    @property
    def subtracted_values(self) -> dict[int, LaneValue]:
        """Negated values that are only added to the port, with the value to subtract instead."""
        used_numbers = {a.number for v in self.values for a in v.args if isinstance(a, LaneValue)}
        added_values = (v for _, v in self.stores) if self.port.accumulate else ()
        return {
            value.number: operand
            for value in added_values
            for operand in value.args[:1]
            if value.op == "neg"
            and value.number not in used_numbers
            and isinstance(operand, LaneValue)
        }

    @property
    def count(self) -> int:
        """Number of entries along the axis."""
        extent = self.port.shape[self.axis]
        assert isinstance(extent, int)
        return extent


class VectorLoops:
    """Vector loops of one kernel, and the remaining stores."""

    def __init__(self, kernel: KernelIR, requests: Sequence[tuple[str, int]]) -> None:
        if kernel.size_symbol is not None:
            raise ValueError(
                f"{kernel.name}: expected a fixed size, found a kernel of run-time size"
            )
        self.kernel = kernel
        self.assignments = {s.number: s for s in kernel.statements if isinstance(s, Assign)}
        self.ports = {port.name: port for port in kernel.outputs}
        self.stored_entries: dict[Operand, Element] = {}
        self.loops = [self._vector_loop(self.ports[name], axis) for name, axis in requests]
        looped_names = {name for name, _ in requests}
        remaining_statements = [s for s in kernel.statements if not isinstance(s, Assign)]
        if not all(isinstance(s, Store) for s in remaining_statements):
            raise ValueError(f"{kernel.name}: vector loops support no guards")
        self.other_stores = [
            s for s in remaining_statements if isinstance(s, Store) and s.port not in looped_names
        ]

    def required_assignments(self, operands: Sequence[Operand]) -> list[Assign]:
        """Assignments needed for `operands`, in kernel order, except values read from outputs."""
        numbers: set[int] = set()
        stack = list(operands)
        while stack:
            operand = stack.pop()
            if not isinstance(operand, Temporary) or operand in self.stored_entries:
                continue
            if operand.number not in numbers:
                numbers.add(operand.number)
                stack.extend(self.assignments[operand.number].args)
        return [s for number, s in self.assignments.items() if number in numbers]

    def read(self, operand: Operand) -> Operand:
        """Output entry that stores an operand, or the operand."""
        return self.stored_entries.get(operand, operand)

    def _vector_loop(self, port: Port, axis: int) -> VectorLoop:
        stored_values = {s.index: s.value for s in self.kernel.statements
                         if isinstance(s, Store) and s.port == port.name}  # fmt: skip
        loop = _Builder(self, VectorLoop(port, axis))
        for index in stored_values:
            if index[axis] == 0:
                lanes = tuple(
                    stored_values[(*index[:axis], k, *index[axis + 1 :])]
                    for k in range(loop.loop.count)
                )
                loop.store(index, lanes)
        if not port.accumulate:
            self.stored_entries |= {
                value: Element(port.name, index)
                for index, value in stored_values.items()
                if isinstance(value, Temporary)
            }
        return loop.loop


class _Builder:
    """Builder of one vector loop."""

    def __init__(self, whole: VectorLoops, loop: VectorLoop) -> None:
        self.vector_loops, self.loop = whole, loop
        self.lane_values: dict[_LaneOperands, LaneValue] = {}
        self.is_alike_cache: dict[tuple[Operand, Operand, int], bool] = {}

    def store(self, index: tuple[int | str, ...], lanes: _LaneOperands) -> None:
        value = self.value(lanes)
        if not isinstance(value, LaneValue):
            raise self.error(f"{self.loop.port.name}{list(index)} is the same in every lane")
        self.loop.stores.append((tuple(int(entry) for entry in index), value))

    def error(self, text: str) -> ValueError:
        return ValueError(f"{self.vector_loops.kernel.name}: {text}")

    def value(self, lanes: _LaneOperands) -> LaneValue | Operand:
        """Value of the operands, one per lane."""
        if all(lane == lanes[0] for lane in lanes):
            return self.share_operand(lanes[0])
        value = self.lane_values.get(lanes)
        if value is None:
            value = self.lane_values[lanes] = self._new_value(lanes)
            self.loop.values.append(value)
        return value

    def share_operand(self, operand: Operand) -> Operand:
        operand = self.vector_loops.read(operand)
        if isinstance(operand, Temporary) and operand.number not in self.loop.shared_temporaries:
            self.loop.shared_temporaries.append(operand.number)
        return operand

    def _new_value(self, lanes: _LaneOperands) -> LaneValue:
        number = len(self.loop.values)
        entries = [self.vector_loops.read(lane) for lane in lanes]
        axis = _moving_axis(entries)
        if axis is not None:
            assert isinstance(entries[0], Element)
            return LaneValue(number, "", (), entries[0], axis)
        if not all(self.is_alike(lanes[0], lane, k) for k, lane in enumerate(lanes)):
            raise self.error(f"entries of {self.loop.port.name} are not computed alike")
        rows = [self._lane_arguments(lanes[0], lane, k) for k, lane in enumerate(lanes)]
        args = tuple(self.value(column) for column in zip(*rows, strict=True))
        first_lane = lanes[0]
        assert isinstance(first_lane, Temporary)
        return LaneValue(
            len(self.loop.values), self.vector_loops.assignments[first_lane.number].op, args
        )

    def _lane_arguments(self, first: Operand, operand: Operand, k: int) -> tuple[Operand, ...]:
        """Operands of lane k, in the order of those of the first lane."""
        assert isinstance(first, Temporary) and isinstance(operand, Temporary)
        reference_args, operand_args = (
            self.vector_loops.assignments[o.number].args for o in (first, operand)
        )
        if all(self.is_alike(a, b, k) for a, b in zip(reference_args, operand_args, strict=True)):
            return operand_args
        return operand_args[::-1]

    def is_alike(self, first: Operand, operand: Operand, k: int) -> bool:
        """Whether an operand of lane k has the same computation as in the first lane."""
        key = first, operand, k
        if key not in self.is_alike_cache:
            self.is_alike_cache[key] = first == operand or self._has_same_computation(
                first, operand, k
            )
        return self.is_alike_cache[key]

    def _has_same_computation(self, first: Operand, other: Operand, k: int) -> bool:
        entries = [self.vector_loops.read(operand) for operand in (first, other)]
        if _moving_axis([entries[0], *[None] * (k - 1), entries[1]]) is not None:
            return True
        if not isinstance(first, Temporary) or not isinstance(other, Temporary):
            return False
        reference_assignment, operand_assignment = (
            self.vector_loops.assignments[o.number] for o in (first, other)
        )
        row = OPERATIONS[reference_assignment.op]
        if (
            reference_assignment.op != operand_assignment.op
            or row.truth
            or row.conditions
            or not (row.sign or reference_assignment.op == "neg")
        ):
            return False
        orders = (
            [operand_assignment.args, operand_assignment.args[::-1]]
            if row.commutative
            else [operand_assignment.args]
        )
        return any(
            all(
                self.is_alike(a, b, k)
                for a, b in zip(reference_assignment.args, order, strict=True)
            )
            for order in orders
        )


def _moving_axis(places: Sequence[Operand | None]) -> int | None:
    """The axis along which entries of a port move by one from lane to lane (None: no such axis)."""
    first_entry = places[0]
    if not isinstance(first_entry, Element):
        return None
    for axis in range(len(first_entry.index)):
        leading, start, trailing = (
            first_entry.index[:axis],
            first_entry.index[axis],
            first_entry.index[axis + 1 :],
        )
        assert isinstance(start, int)
        expected = (
            Element(first_entry.port, (*leading, start + k, *trailing)) for k in range(len(places))
        )
        if all(p is None or p == w for p, w in zip(places, expected, strict=True)):
            return axis
    return None
