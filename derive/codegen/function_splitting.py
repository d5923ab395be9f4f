"""Split a long straight-line function into several C functions, to limit compile time.

The compile time of gcc grows faster than the length of a function: 4000 statements need 6.3 s in
one piece and 1.8 s in parts, 52 000 need 70 s and 6 s.  The parts also run faster (a tree of 25
pins 1.65 us instead of 2.02 us).  Arrays hold the values that one part computes and others read;
their entries are reused after the last read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from mstmm.ir import Assign, Guard, Store, Temporary

from ..fuse.instruction_scheduling import Line, operands
from .straight_line import GUARDS_NAME, Guards, StraightText, parameter_list, port_array_name

#: Statements per part, and the longest function that is not split; measured.
PART_SIZE, MAX_UNSPLIT_SIZE = 1000, 2000
#: C names of the arrays of values and of truth values between parts.
_VALUES_NAME, _TRUTHS_NAME = "kept", "truths"


@dataclass(frozen=True)
class CrossingValues:
    """Array indices of the values that one part computes (0: before all parts) and others read."""

    defining_parts: Mapping[int, int]
    indices: Mapping[int, int]
    width: int


def find_crossing(
    head: Iterable[int], parts: Sequence[Sequence[Line]], in_the_end: Iterable[int], kind: set[int]
) -> CrossingValues:
    """Assign indices to the temporaries in `kind`; `in_the_end` are read after all parts."""
    part_of_number = dict.fromkeys(head, 0)
    part_of_number |= {
        s.number: k for k, part in enumerate(parts, 1) for s in part if isinstance(s, Assign)
    }
    last_part: dict[int, int] = {}
    for k, part in enumerate(parts, 1):
        last_part |= {
            n: k for s in part for n in temporaries_read(s) if part_of_number[n] != k and n in kind
        }
    last_part |= {n: len(parts) + 1 for n in in_the_end if part_of_number[n] and n in kind}
    departures = sorted((k, number) for number, k in last_part.items())
    index_of_number: dict[int, int] = {}
    free_indices: list[int] = []
    width = n_departed = 0
    for number in sorted(last_part, key=lambda n: (part_of_number[n], n)):
        while departures[n_departed][0] < part_of_number[number]:
            free_indices.append(index_of_number[departures[n_departed][1]])
            n_departed += 1
        if not free_indices:
            free_indices.append(width)
            width += 1
        index_of_number[number] = free_indices.pop()
    return CrossingValues(part_of_number, index_of_number, width)


def temporaries_read(statement: Line) -> list[int]:
    """Temporaries that a statement reads."""
    return [a.number for a in operands(statement) if isinstance(a, Temporary)]


def statement_text(text: StraightText, statement: Line, guards: Guards) -> list[str]:
    """C lines of one statement."""
    if isinstance(statement, Assign):
        return text.assign(statement)
    if isinstance(statement, Store):
        return [text.store(statement)]
    return guards.emit_guard(statement)


class FunctionParts:
    """C text of one straight line in parts, after lines that compute the temporaries `head`.

    `functions` are the parts.
    """

    def __init__(
        self,
        text: StraightText,
        name: str,
        head: Sequence[int],
        statements: Sequence[Line],
        guards: Guards,
    ) -> None:
        self._text, self._name, self._head, self._guards = text, name, head, guards
        parts = [statements[k : k + PART_SIZE] for k in range(0, len(statements), PART_SIZE)]
        self._count = len(parts)
        guard_statements = (
            [s for s in statements if isinstance(s, Guard)] if guards.in_lanes else []
        )
        final_reads = dict.fromkeys(
            number for guard in guard_statements for number in temporaries_read(guard)
        )
        all_numbers = {*head, *(s.number for s in statements if isinstance(s, Assign))}
        self._values = find_crossing(head, parts, final_reads, all_numbers - text.truths)
        self._truths = find_crossing(head, parts, final_reads, all_numbers & text.truths)
        self._final_reads = [n for n in final_reads if self._values.defining_parts[n]]
        self.functions = "\n".join(self._function(k, part) for k, part in enumerate(parts, 1))

    def calls(self) -> list[str]:
        """C lines that call the parts and reload the values that are read after them."""
        dialect, arguments = self._text.dialect, ", ".join(self._arguments())
        widths = max(1, self._values.width), max(1, self._truths.width)
        return [
            f"{dialect.real} {_VALUES_NAME}[{widths[0]}];",
            f"{dialect.truth} {_TRUTHS_NAME}[{widths[1]}];",
            *self._store_lines(self._head),
            *(f"{self._part_name(k)}({arguments});" for k in range(1, self._count + 1)),
            *self._load_lines(self._final_reads),
        ]

    def _arguments(self) -> list[str]:
        kernel = self._text.kernel
        ports = [port_array_name(port.name) for port in (*kernel.inputs, *kernel.outputs)]
        return [*ports, _VALUES_NAME, _TRUTHS_NAME, *([GUARDS_NAME] * self._guards.counts_guards)]

    def _part_name(self, k: int) -> str:
        return f"{self._name}_part{k}"

    def _function(self, k: int, part: Sequence[Line]) -> str:
        text, dialect = self._text, self._text.dialect
        lines = [f"(void){argument};" for argument in self._arguments()]
        loaded: set[int] = set()
        for statement in part:
            if not (isinstance(statement, Guard) and self._guards.in_lanes):
                foreign_numbers = {
                    n: None
                    for n in temporaries_read(statement)
                    if self._values.defining_parts[n] != k
                }
                lines += self._load_lines(n for n in foreign_numbers if n not in loaded)
                loaded.update(foreign_numbers)
            lines += statement_text(text, statement, self._guards)
            if isinstance(statement, Assign):
                lines += self._store_lines([statement.number])
        parameters = [
            *parameter_list(text.kernel, dialect), f"{dialect.real} *restrict {_VALUES_NAME}",
            f"{dialect.truth} *restrict {_TRUTHS_NAME}",
            *([f"int *restrict {GUARDS_NAME}"] if self._guards.counts_guards else []),
        ]  # fmt: skip
        body, parameter_text = (
            "\n".join(f"    {line}" for line in lines),
            ",\n    ".join(parameters),
        )
        head = f"static __attribute__((noinline)) void {self._part_name(k)}(\n    {parameter_text})"
        return f"{head}\n{{\n{body}\n}}\n"

    def _store_lines(self, numbers: Iterable[int]) -> list[str]:
        """C lines that store the temporaries that other parts read."""
        lines = []
        for number in numbers:
            if number in self._values.indices:
                lines.append(f"{_VALUES_NAME}[{self._values.indices[number]}] = t{number};")
            if number in self._truths.indices:
                lines.append(f"{_TRUTHS_NAME}[{self._truths.indices[number]}] = m{number};")
        return lines

    def _load_lines(self, numbers: Iterable[int]) -> list[str]:
        """C lines that load temporaries of other parts, under the same names."""
        text, lines = self._text, []
        for number in numbers:
            if number in self._values.indices:
                index = self._values.indices[number]
                lines.append(f"const {text.dialect.real} t{number} = {_VALUES_NAME}[{index}];")
            else:
                index = self._truths.indices[number]
                lines.append(f"const {text.dialect.truth} m{number} = {_TRUTHS_NAME}[{index}];")
                lines.append(f"(void)m{number};")  # possibly read only as a number
                lines += text.truth_to_number(number)
        return lines
