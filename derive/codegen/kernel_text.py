"""Statements of a KernelIR as C text: names, literals, expressions.  No templates here.

The C computes what `derive.verification.kernel_evaluation` computes with plain floats, operation by
operation, and a NaN is never hidden by min, max, sign or a guard.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from fractions import Fraction
from typing import Any

from mstmm.abi.element_library import REAL, parameter_names, work_name
from mstmm.ir import (
    OPERATIONS,
    Assign,
    Constant,
    Element,
    Guard,
    Inner,
    KernelIR,
    Operand,
    Port,
    Solve,
    Store,
    Sum,
    Temporary,
)

from .vector_loops import LaneValue, VectorLoop, VectorLoops

#: Operations on complex numbers as functions of C.
_COMPLEX = {
    "add": "mstmm_complex_plus({}, {})", "sub": "mstmm_complex_minus({}, {})",
    "mul": "mstmm_complex_times({}, {})", "neg": "mstmm_complex_scaled(-1, {})",
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
        self._plain_ports, self._plain_numbers = plain, set[int]()
        self._complex = bool(plain)

    def statements(self) -> list[dict[str, Any]]:
        """One dictionary per statement; its `kind` is assign, sum, store, guard, solve or alike."""
        if self.vector_loops is not None:
            return self._loops(self.vector_loops)
        return [self._statement(statement) for statement in self.kernel.statements]

    def _loops(self, alike: VectorLoops) -> list[dict[str, Any]]:
        """Vector loops, each after its shared values, then the remaining stores."""
        views: list[dict[str, Any]] = []
        numbers: set[int] = set()

        def add_shared(operands: Sequence[Operand]) -> None:
            for assign in alike.required_assignments(operands):
                if assign.number not in numbers:
                    numbers.add(assign.number)
                    views.append(self._statement(assign))

        for loop in alike.loops:
            add_shared([Temporary(number) for number in loop.shared_temporaries])
            views.append({"kind": "alike", "lines": self._loop(loop)})
        for store in alike.other_stores:
            add_shared([store.value])
            views.append(self._statement(store))
        return views

    def _loop(self, loop: VectorLoop) -> list[str]:
        """C lines of one loop over pairs of entries.

        For an odd count the last pair repeats the entry before it, or, if the port accumulates,
        consists of the last entry twice."""
        port, last_index = self.ports[loop.port.name], loop.count - 1
        has_odd_count = loop.count % 2 == 1 and port.accumulate
        lines = [f"for (int k = 0; k < {loop.count}; k += 2) {{"]
        if has_odd_count:
            lines.append(f"    const int next = k < {last_index};")
        elif loop.count % 2 == 1:
            lines = [f"for (int k = 0; k < {last_index}; k += k < {last_index - 2} ? 2 : 1) {{"]
        subtracted = loop.subtracted_values
        for value in loop.values:
            if value.number not in subtracted:
                lines.append(
                    f"    const two_t v{value.number} = {self._pair(value, has_odd_count)};"
                )
        second_lines = []
        for index, stored_value in loop.stores:
            value, sign = stored_value, "+=" if port.accumulate else "="
            if stored_value.number in subtracted:
                value, sign = subtracted[stored_value.number], "-="
            pointer, stride = self._lane_pointer(port, index, loop.axis)
            if stride == 1 and not has_odd_count:
                lines.append(f"    *(two_free_t *)({pointer}) {sign} v{value.number};")
                continue
            array, start = self.names[port.name], port.offset(index)
            index_text = f"{stride} * k" if stride != 1 else "k"
            lines.append(f"    {array}[{start} + {index_text}] {sign} v{value.number}[0];")
            second_lines.append(
                f"{array}[{start + stride} + {index_text}] {sign} v{value.number}[1];"
            )
        if second_lines and has_odd_count:
            second_lines = ["if (next) {", *(f"    {line}" for line in second_lines), "}"]
        return [*lines, *(f"    {line}" for line in second_lines), "}"]

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
        names_read: set[str] = set()
        for statement in self.kernel.statements:
            operands = list(_operands(statement))
            names_read |= {self.names[o.port] for o in operands if isinstance(o, Element)}
            if isinstance(statement, Solve):
                names_read |= {self.names[statement.matrix], self.names[statement.right]}
        return names_read

    def _statement(self, statement: object) -> dict[str, Any]:
        if isinstance(statement, (Assign, Sum)):
            return self._inner_statement(statement)
        if isinstance(statement, Store):
            port = self.ports[statement.port]
            return {
                "kind": "store",
                "loops": statement.loops,
                "body": [self._inner_statement(a) for a in statement.body],
                "target": self._entry(port, statement.index),
                "sign": "+=" if port.accumulate else "=",
                "value": self._array_operand(statement.value),
            }
        if isinstance(statement, Guard):
            condition = self._truth(statement.condition)
            message = comment_text(statement.message)
            return {
                "kind": "guard", "condition": condition, "code": statement.code,
                "message": message,
            }  # fmt: skip
        assert isinstance(statement, Solve)
        return self._solve(statement)

    def _inner_statement(self, statement: Inner) -> dict[str, Any]:
        if isinstance(statement, Assign):
            return self._assign(statement)
        return {
            "kind": "sum",
            "number": statement.number,
            "over": statement.over,
            "body": [self._inner_statement(inner) for inner in statement.body],
            "value": self._array_operand(statement.value),
        }

    def _assign(self, assign: Assign) -> dict[str, Any]:
        row = OPERATIONS[assign.op]
        if row.truth:
            self._truths.add(assign.number)
        else:
            self._truths.discard(assign.number)
        if self._complex and not self._are_all_plain(assign.args):
            return self._complex_assign(assign)
        self._plain_numbers.add(assign.number)
        operand_texts = [self.operand(a) for a in assign.args]
        truths = {f"t{index}": self._truth(a) for index, a in enumerate(assign.args)}
        expression = row.c.format(*operand_texts, **truths)
        return {
            "kind": "assign", "number": assign.number, "expression": expression,
            "scalar": REAL if self._complex else "real",
        }  # fmt: skip

    # --- complex numbers ------------------------------------------------------------------------

    def _are_all_plain(self, operands: Sequence[Operand]) -> bool:
        return all(
            o.number in self._plain_numbers if isinstance(o, Temporary)
            else not isinstance(o, Element) or o.port in self._plain_ports
            for o in operands
        )  # fmt: skip

    def _complex_assign(self, assign: Assign) -> dict[str, Any]:
        """Operation on complex numbers, or on a complex and a real one, as a function call."""
        self._plain_numbers.discard(assign.number)
        if assign.op == "mul" and any(self._are_all_plain([a]) for a in assign.args):
            args = sorted(assign.args, key=lambda a: not self._are_all_plain([a]))
            operand_texts = [self.operand(a) for a in args]
            call = "mstmm_complex_scaled({}, {})"
        else:
            operand_texts = [self._array_operand(a) for a in assign.args]
            call = _COMPLEX[assign.op]
        return {
            "kind": "assign", "number": assign.number, "expression": call.format(*operand_texts),
            "scalar": "real",
        }  # fmt: skip

    def _array_operand(self, operand: Operand) -> str:
        """C text of an operand in an array's own type."""
        text = self.operand(operand)
        is_real = self._complex and self._are_all_plain([operand])
        return f"mstmm_complex_plain({text})" if is_real else text

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

    def _truth(self, operand: Operand) -> str:
        text = self.operand(operand)
        if isinstance(operand, Temporary) and operand.number in self._truths:
            return f"{text} != 0"
        return f"fabs({text}) > 0"

    def _entry(self, port: Port, index: tuple[int | str, ...]) -> str:
        return f"{self.names[port.name]}[{_entry_offset(port, index)}]"


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


def _operands(statement: object) -> list[Operand]:
    if isinstance(statement, Assign):
        return list(statement.args)
    if isinstance(statement, (Sum, Store)):
        inner = [operand for line in statement.body for operand in _operands(line)]
        return [*inner, statement.value]
    if isinstance(statement, Guard):
        return [statement.condition]
    return []
