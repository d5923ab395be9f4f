"""A library of one kernel in float, double or quadruple precision, called through arrays.

Quadruple precision is IEEE binary128 with 113 bits, computed by the compiler's support functions
and libquadmath: about a hundred times slower than double, for reference solutions.
"""

from __future__ import annotations

from mstmm.border.scalars import SCALARS, SYMBOL
from mstmm.ir import KernelIR

from .scalar_function import scalar_source
from .straight_line import port_name

#: Load expressions by the count of array numbers per value: quadruple values come as unevaluated
#: sums of two doubles, high part first.
_IN = {1: "in[{place}][i]", 2: "(real)in[{place}][2 * i] + (real)in[{place}][2 * i + 1]"}
_OUT = """\
        const number high = (number){port}[i];
        out[{place}][2 * i] = high;
        out[{place}][2 * i + 1] = high - high == 0 ? (number)({port}[i] - (real)high) : 0;
"""


def library_source(kernel: KernelIR, scalar: str) -> str:
    """C text of a library that computes one straight-line kernel in a scalar type.

    It exports `int mstmm_scalar_call(const number *const *in, number *const *out)`: the arrays of
    the kernel's ports in their order, dense; returns 0 or a guard's code.  Outputs that accumulate
    are added to what their arrays hold.  `number` is the type of the arrays (`scalars`).

    Raises ValueError for another type, and for a kernel of run-time size.
    """
    number = "float" if SCALARS[scalar].array == "float32" else "double"
    head = f"typedef {number} number;\n"
    return head + scalar_source(kernel, scalar) + _entry(kernel, SCALARS[scalar].parts)


def _entry(kernel: KernelIR, parts: int) -> str:
    """Exported C function: copy the caller's arrays to the kernel, and the results back."""
    declared, before, after = [], [], []
    for place, port in enumerate(kernel.inputs):
        name, length = port_name(port.name), port.length()
        declared.append(f"    static __thread real {name}[{max(1, length)}];")
        before.append(_loop(length, f"{name}[i] = {_IN[parts].format(place=place)};"))
    for place, port in enumerate(kernel.outputs):
        name, length = port_name(port.name), port.length()
        declared.append(f"    static __thread real {name}[{max(1, length)}];")
        start = _IN[parts].format(place=place).replace("in[", "out[")
        before.append(_loop(length, f"{name}[i] = {start};"))
        if parts == 1:
            after.append(_loop(length, f"out[{place}][i] = {name}[i];"))
        else:
            body = _OUT.format(port=name, place=place)
            after.append(f"    for (int i = 0; i < {length}; i++) {{\n{body}    }}")
    names = [port_name(port.name) for port in (*kernel.inputs, *kernel.outputs)]
    lines = [*declared, "    (void)in, (void)out;", *before]
    lines += [
        f"    const int code = kernel_{kernel.name}({', '.join(names)});",
        *after,
        "    return code;",
    ]
    prototype = f"int {SYMBOL}(const number *const *in, number *const *out)"
    return f"{prototype};\n{prototype}\n{{\n" + "\n".join(lines) + "\n}\n"


def _loop(length: int, body: str) -> str:
    return f"    for (int i = 0; i < {length}; i++) {body}"
