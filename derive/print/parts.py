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

from ..fuse.passes.line import Line, operands
from .guards import GUARDS, Guards
from .straight_line import StraightText, port_name, signature

#: Statements per part, and the longest function that is not split; measured.
SIZE, WHOLE = 1000, 2000
#: C names of the arrays of values and of truth values between parts.
_KEPT, _TRUTHS = "kept", "truths"


@dataclass(frozen=True)
class Crossing:
    """Array indices of the values that one part computes (0: before all parts) and others read."""

    made: Mapping[int, int]
    places: Mapping[int, int]
    width: int


def crossing(
    head: Iterable[int], parts: Sequence[Sequence[Line]], in_the_end: Iterable[int], kind: set[int]
) -> Crossing:
    """Assign indices to the temporaries in `kind`; `in_the_end` are read after all parts."""
    made = dict.fromkeys(head, 0)
    made |= {s.number: k for k, part in enumerate(parts, 1) for s in part if isinstance(s, Assign)}
    last: dict[int, int] = {}
    for k, part in enumerate(parts, 1):
        last |= {n: k for s in part for n in reads(s) if made[n] != k and n in kind}
    last |= {n: len(parts) + 1 for n in in_the_end if made[n] and n in kind}
    leaving = sorted((k, number) for number, k in last.items())
    places: dict[int, int] = {}
    free: list[int] = []
    width = gone = 0
    for number in sorted(last, key=lambda n: (made[n], n)):
        while leaving[gone][0] < made[number]:
            free.append(places[leaving[gone][1]])
            gone += 1
        if not free:
            free.append(width)
            width += 1
        places[number] = free.pop()
    return Crossing(made, places, width)


def reads(statement: Line) -> list[int]:
    """Temporaries that a statement reads."""
    return [a.number for a in operands(statement) if isinstance(a, Temporary)]


def printed(text: StraightText, statement: Line, guards: Guards) -> list[str]:
    """C lines of one statement."""
    if isinstance(statement, Assign):
        return text.assign(statement)
    if isinstance(statement, Store):
        return [text.store(statement)]
    return guards.judged(statement)


class Parts:
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
        parts = [statements[k : k + SIZE] for k in range(0, len(statements), SIZE)]
        self._count = len(parts)
        judged = [s for s in statements if isinstance(s, Guard)] if guards.in_lanes else []
        in_the_end = dict.fromkeys(number for guard in judged for number in reads(guard))
        every = {*head, *(s.number for s in statements if isinstance(s, Assign))}
        self._values = crossing(head, parts, in_the_end, every - text.truths)
        self._truths = crossing(head, parts, in_the_end, every & text.truths)
        self._in_the_end = [n for n in in_the_end if self._values.made[n]]
        self.functions = "\n".join(self._function(k, part) for k, part in enumerate(parts, 1))

    def calls(self) -> list[str]:
        """C lines that call the parts and reload the values that are read after them."""
        dialect, words = self._text.dialect, ", ".join(self._arguments())
        widths = max(1, self._values.width), max(1, self._truths.width)
        return [
            f"{dialect.real} {_KEPT}[{widths[0]}];", f"{dialect.truth} {_TRUTHS}[{widths[1]}];",
            *self._kept(self._head),
            *(f"{self._part(k)}({words});" for k in range(1, self._count + 1)),
            *self._recalled(self._in_the_end),
        ]  # fmt: skip

    def _arguments(self) -> list[str]:
        kernel = self._text.kernel
        ports = [port_name(port.name) for port in (*kernel.inputs, *kernel.outputs)]
        return [*ports, _KEPT, _TRUTHS, *([GUARDS] * self._guards.counted)]

    def _part(self, k: int) -> str:
        return f"{self._name}_part{k}"

    def _function(self, k: int, part: Sequence[Line]) -> str:
        text, dialect = self._text, self._text.dialect
        lines = [f"(void){word};" for word in self._arguments()]
        here: set[int] = set()
        for statement in part:
            if not (isinstance(statement, Guard) and self._guards.in_lanes):
                others = {n: None for n in reads(statement) if self._values.made[n] != k}
                lines += self._recalled(n for n in others if n not in here)
                here.update(others)
            lines += printed(text, statement, self._guards)
            if isinstance(statement, Assign):
                lines += self._kept([statement.number])
        parameters = [
            *signature(text.kernel, dialect), f"{dialect.real} *restrict {_KEPT}",
            f"{dialect.truth} *restrict {_TRUTHS}",
            *([f"int *restrict {GUARDS}"] if self._guards.counted else []),
        ]  # fmt: skip
        body, wrapped = "\n".join(f"    {line}" for line in lines), ",\n    ".join(parameters)
        head = f"static __attribute__((noinline)) void {self._part(k)}(\n    {wrapped})"
        return f"{head}\n{{\n{body}\n}}\n"

    def _kept(self, numbers: Iterable[int]) -> list[str]:
        """C lines that store the temporaries that other parts read."""
        found = []
        for number in numbers:
            if number in self._values.places:
                found.append(f"{_KEPT}[{self._values.places[number]}] = t{number};")
            if number in self._truths.places:
                found.append(f"{_TRUTHS}[{self._truths.places[number]}] = m{number};")
        return found

    def _recalled(self, numbers: Iterable[int]) -> list[str]:
        """C lines that load temporaries of other parts, under the same names."""
        text, found = self._text, []
        for number in numbers:
            if number in self._values.places:
                place = self._values.places[number]
                found.append(f"const {text.dialect.real} t{number} = {_KEPT}[{place}];")
            else:
                place = self._truths.places[number]
                found.append(f"const {text.dialect.truth} m{number} = {_TRUTHS}[{place}];")
                found.append(f"(void)m{number};")  # possibly read only as a number
                found += text.counted(number)
        return found
