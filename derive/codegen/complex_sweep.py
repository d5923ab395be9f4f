"""C text of the tangent's elimination in complex arithmetic, from the real kernels.

A number there is one of several frequencies at a time (runtime/engine/c/complex_lanes.h).  Under
harmonic loads the unknowns are complex amplitudes.  Contributions of bodies are linear in s^2, s
and 1 and are computed once per state in real numbers; the text printed here runs for every s.
Ports independent of s keep the real type, which halves the cost of products with them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from mstmm.abi.element_library import REAL
from mstmm.ir import KernelIR
from mstmm.ir.element_spec import ElementSpec

from ..schedule.pass_steps import Call, Pass, all_steps
from ..schedule.tangent_sweep import (
    TANGENT_BACKWARD,
    TANGENT_COLUMN,
    TANGENT_ELIMINATION,
    TANGENT_FORWARD,
)
from .kernel_calls import (
    MAX_SPEEDS,
    NAMED_CALLEES,
    Callee,
    Specs,
    call_text,
    collect_callees,
    dispatch_tables,
)
from .sweep_text import function_declaration, function_text

PASSES: tuple[Pass, ...] = (TANGENT_ELIMINATION, TANGENT_COLUMN, TANGENT_BACKWARD, TANGENT_FORWARD)
#: Ports of rotations, places, velocities and subspaces of the state.
REAL_PORTS = frozenset({"Rc", "r", "w_I", "v", "w", "H"})
#: Variables that point to the state's numbers, and tangent slots stored there.
_STATE_POINTERS = re.compile(r"\breal \*(?=(?:block|parent|laid|modes)\b)")
_HELD_TANGENTS = {
    "tangent + MSTMM_TANGENT_H(": "state->tangents->held + body->tangent + MSTMM_TANGENT_H(",
    "bend + MSTMM_BEND_ZERO_H(": "state->tangents->held + modal->tangent + MSTMM_BEND_ZERO_H(",
}
_FUNCTION_NAMES = re.compile(
    r"\bmstmm_(?!tangent_at\b|modal_of\b)"
    r"(?=(?:state|fail|elimination_code|solve_lu|set_zero|(?:at|sweep|generic|frames|tangent|modal)_\w+)\b)"
)

#: Zero initialisations, and additions to other values.
_ZERO_VALUES = re.compile(r"((?:complex_t t\d+|\]) = |^ +: )0;", re.MULTILINE)
_FUNCTION_STARTS = re.compile(
    r"^(?=int mstmm_complex_\w+(?<!_sized)\(|mstmm_complex_\w+_kernel \*const)", re.MULTILINE
)
_ADDITIONS = re.compile(r"^( *)(\S.*) ([+-])= (.*);$", re.MULTILINE)


def _called_kernels(specs: Specs) -> dict[str, Callee]:
    """Kernels that the passes call, by "element.kernel"."""
    all_callees = collect_callees(specs)
    steps = (part for sweep_pass in PASSES for step in sweep_pass.steps for part in all_steps(step))
    names = (step.kernel.replace("{free}", "") for step in steps if isinstance(step, Call))
    return {name: all_callees[name] for name in sorted(set(names))}


def complex_kernels(specs: Specs) -> Iterator[tuple[ElementSpec, KernelIR]]:
    """Kernels of the complex passes, for hinges at every number of speeds."""
    for name in _called_kernels(specs):
        element, _, kernel = name.partition(".")
        keys = [NAMED_CALLEES[element]] if element in NAMED_CALLEES else [
            ("sweep", f"generic{n}") for n in range(1, MAX_SPEEDS + 1)
        ]  # fmt: skip
        for key in keys:
            yield specs[key], next(k for k in specs[key].kernels if k.name == kernel)


def complex_passes(specs: Specs) -> str:
    """C text of the named calls and of the passes, in real notation."""
    called = _called_kernels(specs)
    names = {callee.name for callee in called.values()}
    parts = [call_text(callee, REAL_PORTS) for callee in called.values()]
    parts += [dispatch_tables(specs, names)]
    parts += [f"{function_declaration(sweep_pass)};" for sweep_pass in PASSES]
    return "\n".join([*parts, *(function_text(sweep_pass, called) for sweep_pass in PASSES)])


def to_complex(text: str) -> str:
    """Convert C text of the real elimination to complex types and names."""
    for real_text, held_text in _HELD_TANGENTS.items():
        text = text.replace(real_text, held_text)
    text = _STATE_POINTERS.sub(f"{REAL} *", text)
    text = re.sub(r"\breal\b", "complex_t", text)
    text = re.sub(r"\b(in|out)_t\b", r"complex_\1_t", text)
    text = _FUNCTION_NAMES.sub("mstmm_complex_", text)
    text = _ZERO_VALUES.sub(r"\1z_plain(0);", text)
    text = _ADDITIONS.sub(_replace_addition, text)
    text = text.replace("_table[];", f"_table[{MAX_SPEEDS + 1}];").replace("extern ", "")
    return _FUNCTION_STARTS.sub("static ", text)


def _replace_addition(found: re.Match[str]) -> str:
    indent, target, sign, value = found.groups()
    operation = "add" if sign == "+" else "sub"
    return f"{indent}{target} = z_{operation}({target}, {value});"
