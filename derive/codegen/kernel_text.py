"""Statements of a KernelIR as C text: names, literals, expressions.  No templates here.

The C computes what `derive.verification.kernel_evaluation` computes with plain floats, operation by
operation, and a NaN is never hidden by min, max, sign or a guard.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Collection, Sequence
from fractions import Fraction
from itertools import groupby
from typing import Any

from mstmm.abi.element_library import REAL, parameter_names, work_name
from mstmm.ir import (
    OPERATIONS,
    Assign,
    Constant,
    Element,
    Guard,
    KernelIR,
    Operand,
    Port,
    Solve,
    Statement,
    Store,
    Sum,
    Temporary,
)
from mstmm.ir.kernel import read_elements
from mstmm.ir.statements import Expression, Line, Nested, Nesting

from .vector_loops import LaneValue, VectorLoop, VectorLoops

#: Indentation of generated kernels.
INDENT = "  "
_STRING = re.compile(r'"[^"]*"')

#: Operations on complex numbers as functions of C (runtime/engine/c/complex_lanes.h).
_COMPLEX = {
    "add": "z_add({}, {})", "sub": "z_sub({}, {})", "mul": "z_mul({}, {})",
    "neg": "z_scale(-1, {})",
}  # fmt: skip

#: Precedence of C expressions: of an operand as such, products, sums, all others.
_PRIMARY, _PRODUCT, _SUM, _OTHER = 3, 2, 1, 0
#: Operation -> precedence of its text, least precedence of its operands in nested expressions.
_PRECEDENCES = {
    "mul": (_PRODUCT, (_PRODUCT, _PRIMARY)), "div": (_PRODUCT, (_PRODUCT, _PRIMARY)),
    "add": (_SUM, (_SUM, _PRODUCT)), "sub": (_SUM, (_SUM, _PRODUCT)),
    "neg": (_PRODUCT, (_PRIMARY,)), **dict.fromkeys(("lt", "le", "eq"), (_OTHER, (_SUM, _SUM))),
    **{row.name: (_PRIMARY, (_OTHER,)) for row in OPERATIONS.values() if row.is_c_library_function},
}  # fmt: skip


def literal_text(text: str) -> str:
    """C text of a constant ("3", "-1/3", "pi"): exact, or correctly rounded to a double.

    The C compiler divides a quotient of two integers that doubles represent exactly.
    """
    if text == "pi":
        return "MSTMM_PI"
    value = Fraction(text)
    double_value = Constant(text).number
    top, bottom = abs(value.numerator), value.denominator
    if Fraction(double_value) == value or max(top, bottom) > 2**53:
        magnitude_text = repr(abs(double_value))
    else:
        magnitude_text = f"((real){top} / (real){bottom})"
    return f"(-{magnitude_text})" if value < 0 else magnitude_text


def solver_template(solve: Solve) -> str:
    """Name of the solver template; its C function is mstmm_ plus this name."""
    return "solve_ldl" if solve.symmetric else "solve_lu"


def string_literal(text: str) -> str:
    """C string literal; every byte that is not plain ASCII is escaped."""
    escaped_text = "".join(
        chr(byte) if 32 <= byte < 127 and byte not in b'"\\?' else f"\\{byte:03o}"
        for byte in text.encode()
    )
    return f'"{escaped_text}"'


def comment_text(text: str) -> str:
    """Text that is safe inside a C comment on one line."""
    return " ".join(text.split()).replace("*/", "* /").replace("/*", "/ *").rstrip("\\ ")


class KernelText:
    """C text of one kernel's statements, in the form the templates lay out.

    `alike` names outputs whose entries along an axis are printed as a loop (`.alike`); `plain`,
    where arrays are of complex numbers, ports that stay `REAL`.
    """

    def __init__(
        self, kernel: KernelIR, alike: Sequence[tuple[str, int]] = (), plain: Collection[str] = ()
    ) -> None:
        self.kernel = kernel
        self.vector_loops = VectorLoops(kernel, alike) if alike else None
        self.names = parameter_names(kernel)
        self.ports = {port.name: port for port in (*kernel.inputs, *kernel.outputs)}
        self._truths: set[int] = set()
        self._real_ports, self._real_numbers = plain, set[int]()
        self._is_complex = bool(plain)
        self._nesting = Nesting(kernel.statements, _may_nest, is_ordered=False)

    def statements(self) -> list[dict[str, Any]]:
        """One dictionary per statement; its `kind` is text, guard or solve."""
        if self.vector_loops is not None:
            return self._loops(self.vector_loops)
        lines = self._nesting.lines(self.kernel.statements)
        views: list[dict[str, Any]] = []
        for value, group in groupby(lines, key=self._stored_constant):
            if value is None:
                views += [self._statement(*line) for line in group]
                continue
            entries = [
                self._entry(self.ports[store.port], store.index)
                for store, _ in group
                if isinstance(store, Store)
            ]
            text = " = ".join([*entries, f"{self._array_operand(value)};"])
            views.append({"kind": "text", "lines": wrapped_lines(text, INDENT)})
        return views

    def _stored_constant(self, line: Line) -> Constant | None:
        """Constant that a statement stores; its successors with the same one share its C text."""
        statement, args = line
        if (
            isinstance(statement, Store)
            and args
            and isinstance(args[0], Constant)
            and not self.ports[statement.port].accumulate
        ):
            return args[0]
        return None

    def _loops(self, alike: VectorLoops) -> list[dict[str, Any]]:
        """Vector loops, each after its shared values, then the remaining stores."""
        views: list[dict[str, Any]] = []
        numbers: set[int] = set()

        def add_shared(operands: Sequence[Operand]) -> None:
            required = alike.required_assignments(operands)
            assigns = [assign for assign in required if assign.number not in numbers]
            numbers.update(assign.number for assign in assigns)
            views.extend(self._statement(*line) for line in self._nesting.lines(assigns))

        for loop in alike.loops:
            add_shared([Temporary(number) for number in loop.shared_temporaries])
            views.append(
                {"kind": "text", "lines": [f"{INDENT}{line}" for line in self._loop(loop)]}
            )
        for store in alike.other_stores:
            add_shared([store.value])
            views.append(self._statement(store, (store.value,)))
        return views

    def _loop(self, loop: VectorLoop) -> list[str]:
        """C lines of one loop over pairs of entries.

        For an odd count the last pair repeats the entry before it, or, if the port accumulates,
        consists of the last entry twice."""
        port, last_index = self.ports[loop.port.name], loop.count - 1
        has_odd_count = loop.count % 2 == 1 and port.accumulate
        lines = [f"for (int k = 0; k < {loop.count}; k += 2) {{"]
        if has_odd_count:
            lines.append(f"{INDENT}const int next = k < {last_index};")
        elif loop.count % 2 == 1:
            lines = [f"for (int k = 0; k < {last_index}; k += k < {last_index - 2} ? 2 : 1) {{"]
        subtracted = loop.subtracted_values
        for value in loop.values:
            if value.number not in subtracted:
                lines.append(
                    f"{INDENT}const two_t v{value.number} = {self._pair(value, has_odd_count)};"
                )
        second_lines = []
        for index, stored_value in loop.stores:
            value, sign = stored_value, "+=" if port.accumulate else "="
            if stored_value.number in subtracted:
                value, sign = subtracted[stored_value.number], "-="
            pointer, stride = self._lane_pointer(port, index, loop.axis)
            if stride == 1 and not has_odd_count:
                lines.append(f"{INDENT}*(two_free_t *)({pointer}) {sign} v{value.number};")
                continue
            array, start = self.names[port.name], port.offset(index)
            index_text = f"{stride} * k" if stride != 1 else "k"
            lines.append(f"{INDENT}{array}[{start} + {index_text}] {sign} v{value.number}[0];")
            second_lines.append(
                f"{array}[{start + stride} + {index_text}] {sign} v{value.number}[1];"
            )
        if second_lines and has_odd_count:
            second_lines = ["if (next) {", *(f"{INDENT}{line}" for line in second_lines), "}"]
        return [*lines, *(f"{INDENT}{line}" for line in second_lines), "}"]

    def _pair(self, value: LaneValue, odd: bool) -> str:
        """C expression of a value for two neighbouring entries."""
        if value.entry is not None:
            port = self.ports[value.entry.port]
            index = tuple(int(entry) for entry in value.entry.index)
            pointer, stride = self._lane_pointer(port, index, value.axis)
            if stride == 1 and not odd:
                return f"mstmm_beside({pointer})"
            distance = f"{stride} * next" if odd else str(stride)
            return f"mstmm_apart({pointer}, {distance})"
        operand_texts = [
            f"v{a.number}" if isinstance(a, LaneValue) else self.operand(a) for a in value.args
        ]
        return OPERATIONS[value.op].c.format(*operand_texts)

    def _lane_pointer(self, port: Port, index: tuple[int, ...], axis: int) -> tuple[str, int]:
        """Pointer to the entry of the loop's k, and the distance to the next entry."""
        stride = port.offset((*index[:axis], index[axis] + 1, *index[axis + 1 :]))
        stride -= port.offset(index)
        index_text = f"{stride} * k" if stride != 1 else "k"
        return f"{self.names[port.name]} + {port.offset(index)} + {index_text}", stride

    def used_names(self) -> set[str]:
        """C names of the input arrays that the statements read."""
        names_read = {self.names[entry.port] for entry in read_elements(self.kernel)}
        for statement in self.kernel.statements:
            if isinstance(statement, Solve):
                names_read |= {self.names[statement.matrix], self.names[statement.right]}
        return names_read

    def _statement(self, statement: Statement, args: Sequence[Nested]) -> dict[str, Any]:
        if isinstance(statement, Guard):
            message = comment_text(statement.message)
            return {
                "kind": "guard", "condition": self._truth(args[0]), "code": statement.code,
                "message": message,
            }  # fmt: skip
        if isinstance(statement, Solve):
            return self._solve(statement)
        return {"kind": "text", "lines": self._lines(statement, args, INDENT)}

    def _lines(self, statement: Statement, args: Sequence[Nested], indent: str) -> list[str]:
        """C lines of an assignment, a sum or a store."""
        if isinstance(statement, Assign):
            self._define(statement, args)
            value, _ = self._value(statement.op, args)
            is_real = self._is_complex and statement.number in self._real_numbers
            scalar = REAL if is_real else "real"
            return wrapped_lines(f"{scalar} t{statement.number} = {value};", indent)
        head: list[str] = []
        if isinstance(statement, Sum):
            start = "z_plain(0)" if self._is_complex else "0"
            head = [f"{indent}real t{statement.number} = {start};"]
            loops, target, sign = statement.over, f"t{statement.number}", "+"
        else:
            assert isinstance(statement, Store)
            port = self.ports[statement.port]
            loops, target = "".join(statement.loops), self._entry(port, statement.index)
            sign = "+" if port.accumulate else ""
            if args:
                return wrapped_lines(self._assignment(target, sign, args[0]), indent)
        body, result = self._nesting.body(statement)
        inner = indent + INDENT * len(loops)
        lines = [
            f"{indent}{INDENT * depth}for (int {k} = 0; {k} < n; ++{k}) {{"
            for depth, k in enumerate(loops)
        ]
        lines += [line for part in body for line in self._lines(*part, inner)]
        lines += wrapped_lines(self._assignment(target, sign, result), inner)
        lines += [f"{indent}{INDENT * depth}}}" for depth in reversed(range(len(loops)))]
        return head + lines

    def _assignment(self, target: str, sign: str, value: Nested) -> str:
        """`target = value;`, or with the sign + `target += value;`."""
        text = self._array_operand(value)
        if self._is_complex and sign:
            return f"{target} = z_add({target}, {text});"
        return f"{target} {sign}= {text};"

    def _define(self, assign: Assign, args: Sequence[Nested]) -> None:
        """Keep whether the value of an assignment is a truth value, and whether it is real."""
        if OPERATIONS[assign.op].truth:
            self._truths.add(assign.number)
        if all(map(self._is_real, args)):
            self._real_numbers.add(assign.number)

    def _value(self, op: str, args: Sequence[Nested]) -> tuple[str, int]:
        """C text of an operation, and its precedence."""
        if self._is_complex and not all(map(self._is_real, args)):
            return self._complex_value(op, args), _PRIMARY
        row = OPERATIONS[op]
        precedence, least = _PRECEDENCES.get(op, (_OTHER, (_PRIMARY,) * row.arity))
        texts = [self._operand(a, limit) for a, limit in zip(args, least, strict=True)]
        truths = {f"t{k}": self._truth(a) for k, a in enumerate(args[: row.conditions])}
        return row.c.format(*texts, **truths), precedence

    def _operand(self, operand: Nested, least: int) -> str:
        """C text of an operand, in brackets if its precedence is below `least`."""
        if not isinstance(operand, Expression):
            return self.operand(operand)
        text, precedence = self._value(operand.assign.op, operand.args)
        return f"({text})" if precedence < least else text

    # --- complex numbers ------------------------------------------------------------------------

    def _is_real(self, operand: Nested) -> bool:
        """Whether a number is real although arrays are complex."""
        if isinstance(operand, Expression):
            return all(map(self._is_real, operand.args))
        if isinstance(operand, Temporary):
            return operand.number in self._real_numbers
        return not isinstance(operand, Element) or operand.port in self._real_ports

    def _complex_value(self, op: str, args: Sequence[Nested]) -> str:
        """Operation on complex numbers, or on a complex and a real one, as a function call."""
        if op == "mul" and any(map(self._is_real, args)):
            real, other = sorted(args, key=self._is_real, reverse=True)
            return f"z_scale({self._operand(real, _OTHER)}, {self._operand(other, _OTHER)})"
        return _COMPLEX[op].format(*map(self._array_operand, args))

    def _array_operand(self, operand: Nested) -> str:
        """C text of an operand in an array's own type."""
        text = self._operand(operand, _OTHER)
        return f"z_plain({text})" if self._is_complex and self._is_real(operand) else text

    def _solve(self, solve: Solve) -> dict[str, Any]:
        columns = self.ports[solve.right].shape[1:]
        width = columns[0] if columns else 1
        return {
            "kind": "solve",
            "function": f"mstmm_{solver_template(solve)}",
            "negative": not solve.symmetric,
            "columns": "n" if isinstance(width, str) else width,
            "matrix": self.names[solve.matrix],
            "right": self.names[solve.right],
            "output": self.names[solve.port],
            "work": work_name(self.kernel),
            "relative_pivot": repr(solve.relative_pivot),
            "code": solve.code,
            "message": comment_text(solve.message),
        }

    def operand(self, operand: Operand) -> str:
        """C text of an operand: a literal, an entry of an array or a temporary."""
        if self.vector_loops is not None:
            operand = self.vector_loops.read(operand)
        if isinstance(operand, Constant):
            return literal_text(operand.text)
        if isinstance(operand, Temporary):
            return f"t{operand.number}"
        return self._entry(self.ports[operand.port], operand.index)

    def _truth(self, operand: Nested) -> str:
        if isinstance(operand, Expression) and OPERATIONS[operand.assign.op].truth:
            return self._operand(operand, _PRIMARY)
        text = self._operand(operand, _OTHER)
        is_truth = isinstance(operand, Temporary) and operand.number in self._truths
        return f"{text} != 0" if is_truth else f"fabs({text}) > 0"

    def _entry(self, port: Port, index: tuple[int | str, ...]) -> str:
        return f"{self.names[port.name]}[{_entry_offset(port, index)}]"


def _may_nest(value: Assign, reader: Assign | None, place: int) -> bool:
    """Whether the C text of a reader may contain that of an operand.

    It must occur once, and be evaluated in any case; truth values are conditions.
    """
    if reader is None:
        return True
    if OPERATIONS[value.op].truth:
        return place < OPERATIONS[reader.op].conditions
    return reader.op in _PRECEDENCES


def wrapped_lines(text: str, indent: str) -> list[str]:
    """Lines of one C statement or initialiser."""
    text = _STRING.sub(lambda string: string[0].replace(" ", "\0"), text)
    lines = textwrap.wrap(
        text, 100, initial_indent=indent, subsequent_indent=f"{indent}{INDENT}",
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
    return [line.replace("\0", " ") for line in lines]


def _entry_offset(port: Port, index: tuple[int | str, ...]) -> str:
    """Row-major offset of an entry as C text, with `n` and `k` of the shape or the index."""
    terms: list[str] = []
    constant_offset = 0
    for axis, entry in enumerate(index):
        later = port.shape[axis + 1 :]
        stride = 1
        factors = ["n" for extent in later if isinstance(extent, str)]
        for extent in later:
            stride *= extent if isinstance(extent, int) else 1
        if isinstance(entry, int) and not factors:
            constant_offset += entry * stride
            continue
        coefficient = stride if isinstance(entry, str) else stride * entry
        if coefficient:
            factor_texts = ([str(coefficient)] if coefficient != 1 else []) + factors
            terms.append(
                " * ".join(factor_texts + ([entry] if isinstance(entry, str) else [])) or "1"
            )
    if constant_offset or not terms:
        terms.append(str(constant_offset))
    return " + ".join(terms)
