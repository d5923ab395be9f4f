"""C calls of kernels with named arguments, which exclude errors of argument order.

For each kernel that the engine's C calls there is a struct of its arrays, by their names, and an
inline function that passes them in the kernel's order; a macro combines both:

    mstmm_frames_pose(.A_I = ..., .x_I = ..., .Rc = ..., .r = ..., .A = ..., .x = ...);
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from mstmm.abi import element_library as abi
from mstmm.ir import KernelIR
from mstmm.ir.element_spec import ElementSpec

from .kernel_text import wrapped_lines

Specs = Mapping[tuple[str, str], ElementSpec]

#: Kernels that are called by their own names: short name -> element.
NAMED_CALLEES = {
    "frames": ("sweep", "frames"),
    "modal": ("sweep", "modal"),
    "tangent": ("sweep", "tangent"),
    "qr": ("sweep", "qr"),
    "loops": ("sweep", "loops"),
    "planar": ("sweep", "planar_pin"),
    "classical_body": ("classical", "body_spatial"),
    "classical_pin": ("classical", "pin_spatial"),
    "classical_ball": ("classical", "ball"),
    "classical_acceleration": ("classical", "acceleration"),
    **{
        f"discrete_{name}": ("classical", f"{name}_discrete")
        for name in ("body_planar", "beam_planar", "body_spatial", "beam_spatial")
    },
    **{
        f"discrete_{hinge}_{pairing}": ("classical", f"hinge_{hinge}_{pairing}")
        for hinge in (
            "fixed_planar", "smooth_planar", "spring_planar",
            "fixed_spatial", "ball_spatial", "pin_spatial", "elastic_spatial",
        )
        for pairing in ("rigid_rigid", "rigid_beam", "beam_beam", "beam_rigid")
    },
}  # fmt: skip
#: Kernels that a record points to: short name -> (element that has the same ports, kernels).  The
#: two kinds of laws have the ports of the named kernels.
POINTER_CALLEES = {
    "hinge": (
        ("hinge", "pin"),
        {
            k: k
            for k in ("hinge", "forward", "condense", "recover", "hinge_slope",
                      "rates_by_coordinates", "rates_by_speeds", "body_motion", "directions")
        },
    ),
    "body": (
        ("body", "rigid"),
        {
            k: k
            for k in ("inertia", "bias_load", "energy", "bias_load_slope", "load_by_motion")
        },
    ),
    "law": (
        ("sweep", "laws"),
        {
            "coordinate": "full", "quaternion": "six",
            "coordinate_slope": "full_slope", "quaternion_slope": "six_slope",
        },
    ),
    "force": (("force", "spring"), {k: k for k in ("wrench", "wrench_slope")}),
    "link": (
        ("sweep", "link_pin"), {k: k for k in ("turn", "forward", "condense", "recover")},
    ),
}  # fmt: skip
#: Largest number of speeds of a hinge, and the kernels that exist for every number of speeds (some
#: not for zero).
MAX_SPEEDS = 6
GENERIC_KERNELS = (
    "forward", "condense", "recover", "effort", "required_load", "project", "factor", "column_load",
    "ground_column_load", "column_acceleration", "qr_eliminate", "complement", "divide", "couple",
    "add_known_part", "add_multiplier_effort", "forward_slope", "effort_slope", "complement_slope",
    "add_known_part_slope", "add_multiplier_effort_slope", "tangent_carrier", "tangent_column",
    "tangent_coordinate_change", "tangent_steady", "tangent_rotational", "tangent_rows",
    "tangent_reduce", "tangent_load", "tangent_solution", "tangent_load_with_increments",
    "tangent_solution_with_increments",
)  # fmt: skip


@dataclass(frozen=True)
class Callee:
    """A kernel as called from C: `name` after "mstmm_", `kernel` with the widest ports.

    `call_kind`: "name" for a function, "speeds" for a table by numbers of speeds, "pointer".
    """

    name: str
    kernel: KernelIR
    call_kind: str
    function: str = ""

    @property
    def fields(self) -> dict[str, str]:
        """port -> C name, inputs first; the work array of a solve included."""
        names = abi.parameter_names(self.kernel)
        outputs = {p.name: names.get(p.name, p.name) for p in abi.c_outputs(self.kernel)}
        return {port.name: names[port.name] for port in self.kernel.inputs} | outputs


def collect_callees(specs: Specs) -> dict[str, Callee]:
    """Every kernel that the engine calls, by "element.kernel" as the schedule has it."""
    return dict(_iterate_callees(specs))


def _iterate_callees(specs: Specs) -> Iterator[tuple[str, Callee]]:
    for short, key in NAMED_CALLEES.items():
        for kernel in specs[key].kernels:
            symbol = abi.kernel_symbol(*key, kernel.name)
            yield f"{short}.{kernel.name}", Callee(f"{short}_{kernel.name}", kernel, "name", symbol)
    for name in GENERIC_KERNELS:
        kernels = [
            kernel
            for n in range(MAX_SPEEDS + 1)
            for kernel in specs["sweep", f"generic{n}"].kernels
            if kernel.name == name
        ]
        _check_same_ports(kernels)
        yield f"generic.{name}", Callee(f"generic_{name}", kernels[-1], "speeds")
    for short, (key, names) in POINTER_CALLEES.items():
        for name, ported_kernel in names.items():
            kernel = _find_kernel(specs[key], ported_kernel)
            if short == "hinge":
                hinges = (s for s in specs.values() if s.kind == "hinge")
                _check_same_ports([k for s in hinges for k in s.kernels if k.name == name])
            yield f"{short}.{name}", Callee(f"{short}_{name}", kernel, "pointer")


def _find_kernel(spec: ElementSpec, name: str) -> KernelIR:
    return next(kernel for kernel in spec.kernels if kernel.name == name)


def _check_same_ports(kernels: Sequence[KernelIR]) -> None:
    """Raise ValueError unless all kernels have the same ports in the same order."""
    ports = {tuple(port.name for port in (*k.inputs, *k.outputs)) for k in kernels}
    if len(ports) != 1:
        raise ValueError(f"{kernels[0].name}: not every element has the same ports: {ports}")


def kernel_calls_header(specs: Specs) -> str:
    """`kernel_calls.h`."""
    callees_by_name = collect_callees(specs)
    parts = [
        "/* Generated by mstmm; do not edit.  Kernels called by the names of their ports.\n"
        " *\n"
        " * mstmm_frames_pose(.A_I = ..., .x_I = ..., ...) calls a kernel; steps for any hinge\n"
        " * take the number of speeds first, kernels of elements the record's pointer. */\n"
        "#ifndef MSTMM_KERNEL_CALLS_H\n#define MSTMM_KERNEL_CALLS_H\n\n"
        '#include "elements.h"\n',
        *(call_text(callee) for callee in callees_by_name.values()),
        "#endif\n",
    ]
    return "\n".join(parts)


def dispatch_tables(specs: Specs, wanted: Collection[str] | None = None) -> str:
    """C tables of kernels by number of speeds, for all callees or those named in `wanted`."""
    lines = []
    for callee in collect_callees(specs).values():
        if callee.call_kind != "speeds" or (wanted is not None and callee.name not in wanted):
            continue
        kernel = callee.kernel.name
        names = [
            abi.kernel_symbol("sweep", f"generic{n}", kernel)
            if any(kernel == available.name for available in specs["sweep", f"generic{n}"].kernels)
            else "NULL"
            for n in range(MAX_SPEEDS + 1)
        ]
        rows = ",\n".join(f"    {name}" for name in names)
        name = f"mstmm_{callee.name}"
        lines.append(f"{name}_kernel *const {name}_table[] = {{\n{rows},\n}};\n")
    return "\n".join(lines)


def call_text(callee: Callee, plain: Collection[str] = ()) -> str:
    """C of the call of one kernel; `plain` as in `abi.element_library.prototype`."""
    name, fields = f"mstmm_{callee.name}", callee.fields
    inputs = {port.name for port in callee.kernel.inputs}
    has_size = callee.kernel.size_symbol is not None
    members = ["    int n;"] if has_size else []
    for scalar, group in groupby(fields, key=lambda port: _scalar_type(port, inputs, plain)):
        arrays = ", ".join(f"*{fields[port]}" for port in group)
        members += wrapped_lines(f"{scalar} {arrays};", "    ")
    types = ["int"] if has_size else []
    types += [abi.c_parameter_type(port, port in inputs, plain) for port in fields]
    argument_names = [
        f"to.{field}" for field in (["n"] if has_size else []) + list(fields.values())
    ]
    struct = f"struct {name} {{\n" + "\n".join(members) + "\n};\n"

    def body(function: str) -> str:
        call = f"return {function}({', '.join(argument_names)});"
        return "{\n" + "\n".join(wrapped_lines(call, "    ")) + "\n}\n"

    if callee.call_kind == "name":
        return (
            f"{struct}static inline int {name}_by(struct {name} to)\n{body(callee.function)}"
            f"#define {name}(...) MSTMM_NAMED({name}, __VA_ARGS__)\n"
        )
    typedef = "\n".join(wrapped_lines(f"typedef int {name}_kernel({', '.join(types)});", "")) + "\n"
    if callee.call_kind == "speeds":
        dispatch_parameter, target = "int speeds", f"{name}_table[speeds]"
        table_declaration = f"extern {name}_kernel *const {name}_table[];\n"
    else:
        dispatch_parameter, target, table_declaration = (
            "void (*kernel)(void)",
            f"(({name}_kernel *)kernel)",
            "",
        )
    dispatch_argument = dispatch_parameter.split()[-1] if callee.call_kind == "speeds" else "kernel"
    arrays = _array_function(name, callee) if name.startswith("mstmm_hinge_hinge") else ""
    return (
        f"{struct}{typedef}{table_declaration}"
        f"static inline int {name}_by({dispatch_parameter}, struct {name} to)\n{body(target)}"
        f"#define {name}({dispatch_argument}, ...) "
        f"MSTMM_NAMED_OF({name}, {dispatch_argument}, __VA_ARGS__)\n{arrays}"
    )


def _scalar_type(port: str, inputs: Collection[str], plain: Collection[str]) -> str:
    return f"{'const ' if port in inputs else ''}{abi.REAL if port in plain else 'real'}"


def _array_function(name: str, callee: Callee) -> str:
    """C function that collects the arrays in the order of a tape."""
    fields = callee.fields
    lines = [
        f"    inputs[{i}] = to.{fields[port.name]};" for i, port in enumerate(callee.kernel.inputs)
    ]
    lines += [
        f"    outputs[{i}] = to.{fields[port.name]};"
        for i, port in enumerate(callee.kernel.outputs)
    ]
    return (
        f"#define {name.upper()}_INPUTS {len(callee.kernel.inputs)}\n"
        f"#define {name.upper()}_OUTPUTS {len(callee.kernel.outputs)}\n"
        f"static inline void {name}_arrays(struct {name} to, const real **inputs, real **outputs)\n"
        "{\n" + "\n".join(lines) + "\n}\n"
    )
