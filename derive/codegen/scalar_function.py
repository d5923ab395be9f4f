"""A straight-line KernelIR as a C function in any real type: float, double, quadruple.

The text is self-contained and serves references and experiments: every sine is the C library's
(libquadmath's for quadruple), every constant is rounded once to the type.  `scene_text` prints the
fast code for scenes.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from fractions import Fraction

from mstmm.ir import Assign, Constant, Guard, KernelIR, Operand, Store

from .scene_text import support_text
from .straight_line import SCALAR_DIALECT, StraightText, parameter_list

#: Name -> (C type, suffix of functions, suffix of literals).
SCALARS = {
    "float": ("float", "f", "f"),
    "double": ("double", "", ""),
    "quadruple": ("__float128", "q", "Q"),
}

#: Significant digits of literals: more than quadruple precision holds (34).
_DIGITS = 45


def scalar_source(kernel: KernelIR, scalar: str) -> str:
    """C text of one static function `kernel_NAME` in a scalar type.

    Its prototype is `int kernel_NAME(const real *restrict INPUT_, ..., real *restrict OUTPUT_)`.

    Arrays are dense and row-major, inputs before outputs, in the order of the ports.  Returns 0 or
    the code of the first guard that does not hold; then the outputs are undefined.
    `real` is the scalar type ("float", "double" or "quadruple"; the last needs libquadmath).

    Raises ValueError for another type, and for a kernel of run-time size.
    """
    if scalar not in SCALARS:
        raise ValueError(f"unknown scalar type {scalar!r}; expected one of {', '.join(SCALARS)}")
    real, function_suffix, suffix = SCALARS[scalar]
    text = _ScalarText(kernel, suffix)
    lines = [
        f"(void){parameter.split('restrict ')[1]};"
        for parameter in parameter_list(kernel, SCALAR_DIALECT)
    ]
    for statement in kernel.statements:
        if isinstance(statement, Assign):
            lines += text.assign(statement)
        elif isinstance(statement, Guard):
            lines.append(f"if (!{text.truth(statement.condition)}) return {statement.code};")
        elif isinstance(statement, Store):
            lines.append(text.store(statement))
    body = "\n".join(f"    {line}" for line in [*lines, "return 0;"])
    head = (
        f"typedef {real} real;\n"
        f"#define MSTMM_FUNCTION(name) {_paste_suffix('name', function_suffix)}\n"
        f"#define MSTMM_LITERAL(number) {_paste_suffix('number', suffix)}\n"
    )
    parameters = ",\n    ".join(parameter_list(kernel, SCALAR_DIALECT))
    function = f"static int kernel_{kernel.name}(\n    {parameters})\n{{\n{body}\n}}\n"
    return f"{head}{support_text('scalar_type')}\n{function}"


def _paste_suffix(word: str, ending: str) -> str:
    return f"{word}##{ending}" if ending else word


class _ScalarText(StraightText):
    """Statements whose constants have the scalar type of the kernel."""

    def __init__(self, kernel: KernelIR, suffix: str) -> None:
        super().__init__(kernel, SCALAR_DIALECT)
        self._suffix = suffix

    def operand_text(self, operand: Operand) -> str:
        if not isinstance(operand, Constant) or operand.text == "pi":
            return super().operand_text(operand)
        value = Fraction(operand.text)
        with localcontext(prec=_DIGITS):
            digits = f"{Decimal(value.numerator) / Decimal(value.denominator):.{_DIGITS - 1}e}"
        return f"({digits}{self._suffix})"
