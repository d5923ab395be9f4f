"""Straight-line KernelIR as C statements, for one number or for several lanes at a time.

A kernel without run-time size becomes one `const` per value, in an order in which every value
follows its operands.  The same lines are printed in several dialects: plain numbers of any
real type, and GNU C vectors, whose operations are spelled as functions of the support text
(templates/fused_*.c).  An underscore is appended to names of ports, so that they clash with no
other name.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from mstmm.ir import OPERATIONS, Assign, Constant, Guard, KernelIR, Operand, Port, Store, Temporary
from mstmm.ir.statements import operands

from ..fuse.instruction_scheduling import Line
from .kernel_text import literal_text


@dataclass(frozen=True)
class Dialect:
    """C spelling of values: types in registers and arrays, truth type, function prefix."""

    real: str
    array: str
    truth: str
    prefix: str
    vector: bool = False


#: One number at a time, of the type `real` of the text around it.
SCALAR_DIALECT = Dialect("real", "real", "int", "real_")
#: Several numbers at a time, one per lane.
LANE_DIALECT = Dialect("lanes_t", "lanes_array_t", "mask_t", "lanes_", vector=True)


def port_array_name(name: str) -> str:
    """C name of a port's array."""
    return f"{name}_"


def parameter_list(kernel: KernelIR, dialect: Dialect) -> list[str]:
    """C parameters of a kernel's function: inputs, then outputs, in the order of the ports."""
    inputs = [f"const {dialect.array} *restrict {port_array_name(p.name)}" for p in kernel.inputs]
    return inputs + [f"{dialect.array} *restrict {port_array_name(p.name)}" for p in kernel.outputs]


class StraightText:
    """C text of the statements of one straight-line kernel."""

    def __init__(self, kernel: KernelIR, dialect: Dialect) -> None:
        if kernel.size_symbol is not None:
            raise ValueError(f"{kernel.name}: expected a kernel of fixed size")
        self.kernel, self.dialect = kernel, dialect
        self.ports: dict[str, Port] = {p.name: p for p in (*kernel.inputs, *kernel.outputs)}
        #: Temporaries that are truth values.
        self.truths = {
            s.number for s in kernel.statements if isinstance(s, Assign) and OPERATIONS[s.op].truth
        }
        self._numbers = _used_as_numbers(kernel.statements) & self.truths

    def assign(self, statement: Assign) -> list[str]:
        """`const real t12 = ...;`; a truth value is `m12`, also `t12` if it is used as a number."""
        number, op, args = statement.number, statement.op, statement.args
        if not OPERATIONS[op].truth:
            return [f"const {self.dialect.real} t{number} = {self._value(op, args)};"]
        truth = f"const {self.dialect.truth} m{number} = {self._comparison(op, args)};"
        return [truth, *self.truth_to_number(number)]

    def truth_to_number(self, number: int) -> list[str]:
        """C lines that convert a truth value to a number, if any part uses it as such."""
        if number not in self._numbers:
            return []
        value = f"{self.dialect.prefix}number(m{number})"
        return [f"const {self.dialect.real} t{number} = {value}; (void)t{number};"]

    def store(self, statement: Store) -> str:
        """`qdot_[3] = t12;`, or += where the port accumulates."""
        port = self.ports[statement.port]
        sign = "+=" if port.accumulate else "="
        offset = port.offset(statement.index)
        return (
            f"{port_array_name(port.name)}[{offset}] {sign} {self.lane_operand(statement.value)};"
        )

    def truth(self, operand: Operand) -> str:
        """Whether an operand is true, that is, neither zero nor NaN."""
        if isinstance(operand, Temporary) and operand.number in self.truths:
            return f"m{operand.number}"
        return f"{self.dialect.prefix}true({self.lane_operand(operand)})"

    def operand_text(self, operand: Operand) -> str:
        """Operand of an arithmetic operator: a literal, an entry of a port or a temporary."""
        if isinstance(operand, Constant):
            return literal_text(operand.text)
        if isinstance(operand, Temporary):
            return f"t{operand.number}"
        return f"{port_array_name(operand.port)}[{self.ports[operand.port].offset(operand.index)}]"

    def lane_operand(self, operand: Operand) -> str:
        """An operand of the dialect's own type: a literal fills every lane."""
        text = self.operand_text(operand)
        return f"lanes_all({text})" if self._is_bare_literal(operand) else text

    def _is_bare_literal(self, operand: Operand) -> bool:
        return self.dialect.vector and isinstance(operand, Constant)

    def _value(self, op: str, args: Sequence[Operand]) -> str:
        row = OPERATIONS[op]
        if row.sign:
            left_text = (
                self.lane_operand(args[0])
                if self._is_bare_literal(args[1])
                else self.operand_text(args[0])
            )
            return f"{left_text} {row.sign} {self.operand_text(args[1])}"
        if op == "neg":
            return f"-{self.lane_operand(args[0])}"
        condition_count = row.conditions
        operand_texts = [
            *map(self.truth, args[:condition_count]),
            *map(self.lane_operand, args[condition_count:]),
        ]
        return f"{self.dialect.prefix}{op}({', '.join(operand_texts)})"

    def _comparison(self, op: str, args: Sequence[Operand]) -> str:
        row = OPERATIONS[op]
        if row.conditions:  # & and |: the order does not matter, and && does not accept vectors
            return f"{self.truth(args[0])} {row.sign[0]} {self.truth(args[1])}"
        if row.sign:
            return f"{self.lane_operand(args[0])} {row.sign} {self.lane_operand(args[1])}"
        (a,) = args
        if isinstance(a, Temporary) and a.number in self.truths:
            return f"{self.dialect.prefix}not(m{a.number})"
        return f"{self.lane_operand(a)} == {self.lane_operand(Constant('0'))}"


def _used_as_numbers(statements: Iterable[object]) -> set[int]:
    """Temporaries that are used as numbers, not as truth values."""
    numbers: set[int] = set()
    for statement in statements:
        operands_read = operands(statement)
        if isinstance(statement, Guard):
            continue
        if isinstance(statement, Assign) and statement.op == "not":
            continue
        if isinstance(statement, Assign):
            operands_read = operands_read[OPERATIONS[statement.op].conditions :]
        numbers |= {operand.number for operand in operands_read if isinstance(operand, Temporary)}
    return numbers


# --- guards ---------------------------------------------------------------------------------------
# No later statement depends on a guard, and a branch would only hinder optimisation of the code
# after it.  The function therefore counts how many guards hold before the first failure.  In lanes
# the guards are evaluated at the end.

#: C name of two numbers: whether all guards hold so far, and how many held before a failure.
GUARDS_NAME = "guards"


class Guards:
    """The guards of one function's text, in their order."""

    def __init__(self, text: StraightText) -> None:
        self._text, self._conditions = text, list[tuple[str, int]]()
        self.in_lanes = text.dialect.vector
        has_guards = any(isinstance(s, Guard) for s in text.kernel.statements)
        #: Whether GUARDS counts them during evaluation.
        self.counts_guards = has_guards and not self.in_lanes

    def prologue(self) -> list[str]:
        """Lines before the first guard."""
        return [f"int {GUARDS_NAME}[2] = {{1, 0}};"] if self.counts_guards else []

    def emit_guard(self, guard: Guard) -> list[str]:
        """Lines of one guard; the count is updated at the next different code."""
        truth, earlier = self._text.truth(guard.condition), self._conditions[-1:]
        self._conditions.append((truth, guard.code))
        if self.in_lanes:
            return []
        is_new_code = any(code != guard.code for _, code in earlier)
        return [f"{GUARDS_NAME}[1] += {GUARDS_NAME}[0];"] * is_new_code + [
            f"{GUARDS_NAME}[0] &= {truth};"
        ]

    def epilogue(self) -> list[str]:
        """Lines after the last guard, which return the failure code of the function."""
        if self.in_lanes:
            return self._lane_lines()
        if not self._conditions:
            return ["return 0;"]
        guard_codes = [code for _, code in self._conditions]
        codes = [code for i, code in enumerate(guard_codes) if not i or guard_codes[i - 1] != code]
        code_list = ", ".join(map(str, [*codes, 0]))
        return [
            f"static const int codes[] = {{{code_list}}};",
            f"return codes[{GUARDS_NAME}[1] + {GUARDS_NAME}[0]];",
        ]

    def _lane_lines(self) -> list[str]:
        lines = ["for (int i = 0; i < MSTMM_LANES; i++) codes[i] = 0;"]
        if not self._conditions:
            return [*lines, "return 0;"]
        every = " & ".join(truth for truth, _ in self._conditions)
        lines.append(f"if (MSTMM_LIKELY(lanes_every({every}))) return 0;")
        lines += [f"lanes_fail(codes, {truth}, {code});" for truth, code in self._conditions]
        return [*lines, "return 1;"]


# --- functions of bounded length ------------------------------------------------------------------
# The compile time of gcc grows faster than the length of a function: 4000 statements need 6.3 s in
# one piece and 1.8 s in parts, 52 000 need 70 s and 6 s.  The parts also run faster (a tree of 25
# pins 1.65 us instead of 2.02 us).  Arrays hold the values that one part computes and others read;
# their entries are reused after the last read.

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
