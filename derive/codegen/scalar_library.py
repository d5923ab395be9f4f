"""A library of one kernel in float, double or quadruple precision, called through arrays.

Quadruple precision is IEEE binary128 with 113 bits, computed by the compiler's support functions
and libquadmath: about a hundred times slower than double, for reference solutions.
"""

from __future__ import annotations

from mstmm.abi.scalar_types import SCALARS, SYMBOL
from mstmm.ir import KernelIR

from .scalar_function import scalar_source
from .straight_line import port_array_name

#: Load expressions by the count of array numbers per value: quadruple values come as unevaluated
#: sums of two doubles, high part first.
_LOAD_TEXTS = {1: "in[{place}][i]", 2: "(real)in[{place}][2 * i] + (real)in[{place}][2 * i + 1]"}
_STORE_TEXT = """\
        const number high = (number){port}[i];
        out[{place}][2 * i] = high;
        out[{place}][2 * i + 1] = high - high == 0 ? (number)({port}[i] - (real)high) : 0;
"""


def library_source(kernel: KernelIR, scalar: str) -> str:
    """C text of a library that computes one straight-line kernel in a scalar type.

    It exports `int mstmm_scalar_call(const number *const *in, number *const *out)`: the arrays of
    the kernel's ports in their order, dense; returns 0 or a guard's code.  Outputs that accumulate
    are added to the values in their arrays.  `number` is the type of the arrays.

    Raises ValueError for another type, and for a kernel of run-time size.
    """
    number = "float" if SCALARS[scalar].array == "float32" else "double"
    head = f"typedef {number} number;\n"
    return head + scalar_source(kernel, scalar) + _entry_function(kernel, SCALARS[scalar].parts)


def _entry_function(kernel: KernelIR, parts: int) -> str:
    """Exported C function: copy the caller's arrays to the kernel, and the results back."""
    declarations, load_lines, store_lines = [], [], []
    for index, port in enumerate(kernel.inputs):
        name, length = port_array_name(port.name), port.length()
        declarations.append(f"    static __thread real {name}[{max(1, length)}];")
        load_lines.append(
            _loop_text(length, f"{name}[i] = {_LOAD_TEXTS[parts].format(place=index)};")
        )
    for index, port in enumerate(kernel.outputs):
        name, length = port_array_name(port.name), port.length()
        declarations.append(f"    static __thread real {name}[{max(1, length)}];")
        start = _LOAD_TEXTS[parts].format(place=index).replace("in[", "out[")
        load_lines.append(_loop_text(length, f"{name}[i] = {start};"))
        if parts == 1:
            store_lines.append(_loop_text(length, f"out[{index}][i] = {name}[i];"))
        else:
            body = _STORE_TEXT.format(port=name, place=index)
            store_lines.append(f"    for (int i = 0; i < {length}; i++) {{\n{body}    }}")
    names = [port_array_name(port.name) for port in (*kernel.inputs, *kernel.outputs)]
    lines = [*declarations, "    (void)in, (void)out;", *load_lines]
    lines += [
        f"    const int code = kernel_{kernel.name}({', '.join(names)});",
        *store_lines,
        "    return code;",
    ]
    prototype = f"int {SYMBOL}(const number *const *in, number *const *out)"
    return f"{prototype};\n{prototype}\n{{\n" + "\n".join(lines) + "\n}\n"


def _loop_text(length: int, body: str) -> str:
    return f"    for (int i = 0; i < {length}; i++) {body}"
