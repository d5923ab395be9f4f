"""ABI of element kernels, as data: ABI number, C declarations, names of C functions.

The header that generated C includes and the text that cffi parses are both built from the
declarations below, so that they cannot differ.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Collection

from ..ir import LOOPS, KernelIR, Port, Solve
from ..ir.element_spec import ElementSpec

#: Number of the layout below: changed with the layout, and checked when a module is opened.
ABI_VERSION = 2

#: Scalar type of every array.
REAL = "double"

#: Layout of the descriptors.  `length` of a port is the product of the integer extents of its shape
#: and `power` the number of axes of the size symbol: the array holds length * n^power numbers.
ELEMENT_DECLARATIONS = """\
typedef struct {
    const char *name;
    int length;
    const char *unit;
    int accumulate;
    int power;
} mstmm_port;

typedef struct {
    int code;
    const char *message;
} mstmm_guard;

typedef int (*mstmm_call)(int n, const real *const *in, real *const *out);

typedef struct {
    const char *name;
    void (*function)(void);
    mstmm_call call;
    int n_inputs, n_outputs;
    const mstmm_port *inputs, *outputs;
    const char *ir_hash;
    int n_guards;
    const mstmm_guard *guards;
} mstmm_kernel;

typedef struct {
    int abi;
    const char *kind, *name, *hash;
    int nq, nu, np;
    const char *const *q_names, *const *q_units;
    const char *const *u_names, *const *u_units;
    const char *const *p_names, *const *p_units;
    int n_kernels;
    const mstmm_kernel *kernels;
} mstmm_element;
"""

#: Variables that `registry.c` defines.
REGISTRY_DECLARATIONS = """\
extern const mstmm_element *const mstmm_elements[];
extern const int mstmm_element_count;
"""

#: Layout of a tape (`mstmm.ir.tape`) in C.  An instruction is five integers: operation,
#: destination, three operands.  An output is four integers: array, index in it, slot, accumulate.
TAPE_DECLARATIONS = """\
typedef struct {
    int n_inputs;
    const int *input_lengths;
    int n_constants;
    const real *constants;
    int n_slots;
    int n_instructions;
    const int *instructions;
    int n_outputs;
    const int *outputs;
} mstmm_tape;

int mstmm_tape_run(const mstmm_tape *tape, const real *const *inputs, real *workspace,
                   real *const *outputs);
"""

#: Kernels and elements without a C function, because no C code calls them: fused code inlines them
#: from their IR, and the fields of beams are evaluated over arrays when a scene is packed.
_IR_ONLY_KERNELS = frozenset({"eliminate", "recover_factored"})
_IR_ONLY_ELEMENTS = frozenset({("sweep", "screw"), ("sweep", "beam")})

#: Names that a C parameter must not have: C17 keywords, functions and locals of the kernels.
_RESERVED_WORDS = (
    "auto break case char const continue default do double else enum extern float for goto if "
    "inline int long register restrict return short signed sizeof static struct switch typedef "
    "union unsigned void volatile while real n k NULL main "
    "sqrt sin cos tan asin acos atan atan2 sinh cosh tanh exp log pow fabs floor isnan"
)
_RESERVED = frozenset(_RESERVED_WORDS.split())
_TEMPORARY = re.compile(r"t\d+")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def cdef(*, registry: bool = True, tape: bool = False, opened: bool = True) -> str:
    """Declarations for `cffi.FFI.cdef`: the descriptors, and on request registry and tape.

    `opened` is True for a library opened in ABI mode, where cffi reads variables but no constants;
    False for a module that cffi compiles.
    """
    parts = [f"typedef {REAL} real;\n", ELEMENT_DECLARATIONS]
    if registry:
        text = REGISTRY_DECLARATIONS
        parts.append(text.replace("extern const int", "extern int") if opened else text)
    parts += [TAPE_DECLARATIONS] if tape else []
    return "\n".join(parts)


def c_kernels(spec: ElementSpec) -> tuple[KernelIR, ...]:
    """Kernels of an element that have a C function; the others exist only as IR."""
    if (spec.kind, spec.name) in _IR_ONLY_ELEMENTS:
        return ()
    return tuple(kernel for kernel in spec.kernels if kernel.name not in _IR_ONLY_KERNELS)


def has_c(spec: ElementSpec) -> bool:
    """Whether an element has a C file and a descriptor."""
    return not spec.kernels or bool(c_kernels(spec))


def element_symbol(kind: str, name: str) -> str:
    """Name of the C descriptor of an element.  ValueError if it is no valid C name."""
    for part in (kind, name):
        if not _NAME.fullmatch(part):
            raise ValueError(f"{part!r} is no valid C name (letters, digits, underscores)")
    return f"mstmm_{kind}_{name}"


def kernel_symbol(kind: str, name: str, kernel: str) -> str:
    """Name of the C function of a kernel.  ValueError if it is no valid C name."""
    return element_symbol(kind, name) + element_symbol(kind, kernel)[len(f"mstmm_{kind}") :]


def needs_work(kernel: KernelIR) -> bool:
    """Whether the C function needs a last argument, n * n numbers of work space for a factor."""
    return any(isinstance(statement, Solve) for statement in kernel.statements)


def parameter_names(kernel: KernelIR) -> dict[str, str]:
    """C name of every port, in port order; a reserved name gets a trailing underscore.

    ValueError if the name of a port has characters that C does not allow.
    """
    names: dict[str, str] = {}
    loops = LOOPS if kernel.size_symbol else ()
    used_names = {port.name for port in (*kernel.inputs, *kernel.outputs)}
    for port in (*kernel.inputs, *kernel.outputs):
        if not _NAME.fullmatch(port.name):
            raise ValueError(f"{kernel.name}: port {port.name!r} is no valid C name")
        name = port.name
        while name in _RESERVED or name in loops or _TEMPORARY.fullmatch(name):
            name += "_"
        while name != port.name and name in used_names:
            name += "_"
        used_names.add(name)
        names[port.name] = name
    return names


def work_name(kernel: KernelIR) -> str:
    """C name of the work array: `work`, with underscores where a port has that name."""
    used_names = set(parameter_names(kernel).values())
    name = "work"
    while name in used_names:
        name += "_"
    return name


def c_outputs(kernel: KernelIR) -> tuple[Port, ...]:
    """Output arrays of the C function: those of the kernel, then the work array if needed."""
    if not needs_work(kernel):
        return kernel.outputs
    size = kernel.size_symbol or "n"
    return (*kernel.outputs, Port(work_name(kernel), (size, size), meaning="factor L, D of solve"))


def c_parameter_type(port: str, is_input: bool, plain: Collection[str] = ()) -> str:
    """C type of the array of a port as a parameter."""
    if port in plain:
        return f"{'const ' if is_input else ''}{REAL} *restrict"
    return "in_t" if is_input else "out_t"


def prototype(
    kind: str, name: str, kernel: KernelIR, suffix: str = "", plain: Collection[str] = ()
) -> str:
    """C declaration of the function of a kernel, without the semicolon.

    `suffix` is appended to its name; `plain` are inputs of the type `REAL` where other arrays have
    another type.
    """
    names = parameter_names(kernel)
    parameters = ["int n"] if kernel.size_symbol else []
    parameters += [
        f"{c_parameter_type(port.name, True, plain)} {names[port.name]}" for port in kernel.inputs
    ]
    parameters += [f"out_t {names.get(port.name, port.name)}" for port in c_outputs(kernel)]
    arguments = ", ".join(parameter.replace(" ", "\0") for parameter in parameters) or "void"
    text = f"int\0{kernel_symbol(kind, name, kernel.name)}{suffix}({arguments})"
    return textwrap.fill(text, 100, subsequent_indent="    ").replace("\0", " ")
