"""The border between Python and C, as data: ABI number, C declarations, names of C functions.

The header that generated C includes and the text that cffi parses are both made from the
declarations below, so that neither can say something the other does not.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Collection

from ..ir import LOOPS, KernelIR, Port, Solve
from ..ir.spec import ElementSpec

#: Number of the layout below; changed with every change of it, and checked when a module opens.
ABI = 2

#: Scalar type of every array.
REAL = "double"

#: Layout of the descriptors.  `length` of a port multiplies the whole-number extents of its shape
#: and `power` counts how often the size symbol occurs: the array holds length * n^power numbers.
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

#: What `registry.c` defines.
REGISTRY_DECLARATIONS = """\
extern const mstmm_element *const mstmm_elements[];
extern const int mstmm_element_count;
"""

#: A tape (`mstmm.ir.tape`) as C reads it.  Instructions are five whole numbers each: operation,
#: destination, three operands; outputs four each: array, place in it, slot, accumulate.
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

#: What has no C function, for no C calls it: the fused engine replays these kernels from their IR,
#: and the fields of beams are evaluated over whole arrays when a scene is packed.
_REPLAYED_KERNELS = frozenset({"eliminate", "recover_factored"})
_REPLAYED_ELEMENTS = frozenset({("sweep", "screw"), ("sweep", "beam")})

#: Words a C parameter may not be called: C17 keywords, what the kernels call, and their locals.
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

    `opened` for a library opened in ABI mode, where cffi reads no constant but reads a variable;
    False for a module that cffi compiles.
    """
    parts = [f"typedef {REAL} real;\n", ELEMENT_DECLARATIONS]
    if registry:
        text = REGISTRY_DECLARATIONS
        parts.append(text.replace("extern const int", "extern int") if opened else text)
    parts += [TAPE_DECLARATIONS] if tape else []
    return "\n".join(parts)


def c_kernels(spec: ElementSpec) -> tuple[KernelIR, ...]:
    """The kernels of an element that have a C function; of the others there is the IR alone."""
    if (spec.kind, spec.name) in _REPLAYED_ELEMENTS:
        return ()
    return tuple(kernel for kernel in spec.kernels if kernel.name not in _REPLAYED_KERNELS)


def has_c(spec: ElementSpec) -> bool:
    """Whether an element has a C file and a descriptor."""
    return not spec.kernels or bool(c_kernels(spec))


def element_symbol(kind: str, name: str) -> str:
    """Name of the C descriptor of an element.  ValueError if it would not be a C name."""
    for part in (kind, name):
        if not _NAME.fullmatch(part):
            raise ValueError(f"{part!r} is not a name C accepts (letters, digits, underscores)")
    return f"mstmm_{kind}_{name}"


def kernel_symbol(kind: str, name: str, kernel: str) -> str:
    """Name of the C function of a kernel.  ValueError if it would not be a C name."""
    return element_symbol(kind, name) + element_symbol(kind, kernel)[len(f"mstmm_{kind}") :]


def needs_work(kernel: KernelIR) -> bool:
    """Whether the C function takes a last array of n * n numbers to keep a factor in."""
    return any(isinstance(statement, Solve) for statement in kernel.statements)


def parameter_names(kernel: KernelIR) -> dict[str, str]:
    """C name of every port, in port order; a name C cannot use gets an underscore behind it.

    ValueError if a port's name has characters C does not know.
    """
    names: dict[str, str] = {}
    loops = LOOPS if kernel.size_symbol else ()
    taken = {port.name for port in (*kernel.inputs, *kernel.outputs)}
    for port in (*kernel.inputs, *kernel.outputs):
        if not _NAME.fullmatch(port.name):
            raise ValueError(f"{kernel.name}: port {port.name!r} is not a name C accepts")
        name = port.name
        while name in _RESERVED or name in loops or _TEMPORARY.fullmatch(name):
            name += "_"
        while name != port.name and name in taken:
            name += "_"
        taken.add(name)
        names[port.name] = name
    return names


def work_name(kernel: KernelIR) -> str:
    """C name of the work array: `work`, or with underscores where a port is called so."""
    taken = set(parameter_names(kernel).values())
    name = "work"
    while name in taken:
        name += "_"
    return name


def c_outputs(kernel: KernelIR) -> tuple[Port, ...]:
    """Output arrays of the C function: the kernel's, then the work array if it needs one."""
    if not needs_work(kernel):
        return kernel.outputs
    size = kernel.size_symbol or "n"
    return (*kernel.outputs, Port(work_name(kernel), (size, size), meaning="factor L, D of solve"))


def scalar(port: str, plain: Collection[str]) -> str:
    """C type of a port's numbers."""
    return REAL if port in plain else "real"


def prototype(
    kind: str, name: str, kernel: KernelIR, suffix: str = "", plain: Collection[str] = ()
) -> str:
    """C declaration of a kernel's function, without the semicolon; `suffix` ends its name, `plain`
    are inputs that stay `REAL` where other arrays are of another type."""
    names = parameter_names(kernel)
    parameters = ["int n"] if kernel.size_symbol else []
    parameters += [
        f"const {scalar(port.name, plain)} *restrict {names[port.name]}" for port in kernel.inputs
    ]
    parameters += [
        f"real *restrict {names.get(port.name, port.name)}" for port in c_outputs(kernel)
    ]
    words = ", ".join(parameter.replace(" ", "\0") for parameter in parameters) or "void"
    text = f"int\0{kernel_symbol(kind, name, kernel.name)}{suffix}({words})"
    return textwrap.fill(text, 100, subsequent_indent="    ").replace("\0", " ")
