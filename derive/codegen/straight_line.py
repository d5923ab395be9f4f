"""Straight-line KernelIR as C statements, for one number or for several lanes at a time.

A kernel without run-time size becomes one `const` per value, in an order in which every value
follows its operands.  The same lines are printed in several dialects: plain numbers of any
real type, and GNU C vectors, whose operations are spelled as functions of the support text
(templates/fused_*.c).  An underscore is appended to names of ports, so that they clash with no
other name.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mstmm.ir import OPERATIONS, Assign, Constant, Guard, KernelIR, Operand, Port, Store, Temporary
from mstmm.ir.statements import operands

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
