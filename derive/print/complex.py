"""C text of the tangent's elimination in complex arithmetic, from the same kernels and passes.

A number there is one of several frequencies at a time (runtime/engine/c/complex_lanes.h).  Under
harmonic loads the unknowns are complex amplitudes.  Contributions of bodies are linear in s^2, s
and 1 and are computed once per state in real numbers; the text printed here runs for every s.
Ports independent of s keep the real type, which halves the cost of products with them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from mstmm.border.elements import REAL
from mstmm.ir import KernelIR
from mstmm.ir.spec import ElementSpec

from ..schedule.steps import Call, Pass, inner
from ..schedule.tangent import (
    TANGENT_ANSWERED,
    TANGENT_CARRIED,
    TANGENT_COLUMN,
    TANGENT_ELIMINATED,
)
from .callers import DIRECT, MOST_SPEEDS, Callee, Specs, callees, caller, tables
from .sweep import function_text, signature

PASSES: tuple[Pass, ...] = (TANGENT_ELIMINATED, TANGENT_COLUMN, TANGENT_CARRIED, TANGENT_ANSWERED)
#: Ports of rotations, places, velocities and subspaces of the state.
PLAIN = frozenset({"Rc", "r", "w_I", "v", "w", "H"})
#: Variables that point to the state's numbers, and tangent slots stored there.
_STATE = re.compile(r"\breal \*(?=(?:block|parent|laid|modes)\b)")
_HELD = {
    "tangent + MSTMM_TANGENT_H(": "state->tangents->held + body->tangent + MSTMM_TANGENT_H(",
    "bend + MSTMM_BEND_STILL(": "state->tangents->held + modal->tangent + MSTMM_BEND_STILL(",
}
_NAMES = re.compile(
    r"\bmstmm_(?!tangent_at\b|modal_of\b)"
    r"(?=(?:state|fail|judged|solve_lu|set_zero|(?:at|sweep|generic|frames|tangent|modal)_\w+)\b)"
)

#: Zero initialisations, and additions to other values.
_ZERO = re.compile(r"((?:mstmm_complex t\d+|\]) = |^ +: )0;", re.MULTILINE)
_OWN = re.compile(
    r"^(?=int mstmm_complex_\w+(?<!_sized)\(|mstmm_complex_\w+_kernel \*const)", re.MULTILINE
)
_ADDED = re.compile(r"^( *)(\S.*) ([+-])= (.*);$", re.MULTILINE)


def _called(specs: Specs) -> dict[str, Callee]:
    """Kernels that the passes call, by "element.kernel"."""
    known = callees(specs)
    steps = (part for whole in PASSES for step in whole.steps for part in inner(step))
    names = (step.kernel.replace("{free}", "") for step in steps if isinstance(step, Call))
    return {name: known[name] for name in sorted(set(names))}


def complex_kernels(specs: Specs) -> Iterator[tuple[ElementSpec, KernelIR]]:
    """Kernels of the complex passes, for hinges at every number of speeds."""
    for name in _called(specs):
        element, _, kernel = name.partition(".")
        keys = [DIRECT[element]] if element in DIRECT else [
            ("sweep", f"generic{n}") for n in range(1, MOST_SPEEDS + 1)
        ]  # fmt: skip
        for key in keys:
            yield specs[key], next(k for k in specs[key].kernels if k.name == kernel)


def complex_passes(specs: Specs) -> str:
    """C text of the named calls and of the passes, in real notation."""
    found = _called(specs)
    wanted = {callee.name for callee in found.values()}
    parts = [caller(callee, PLAIN) for callee in found.values()]
    parts += [tables(specs, wanted)]
    parts += [f"{signature(whole)};" for whole in PASSES]
    return "\n".join([*parts, *(function_text(whole, found) for whole in PASSES)])


def in_complex(text: str) -> str:
    """Convert C text of the real elimination to complex types and names."""
    for plain, held in _HELD.items():
        text = text.replace(plain, held)
    text = _STATE.sub(f"{REAL} *", text)
    text = re.sub(r"\breal\b", "mstmm_complex", text)
    text = _NAMES.sub("mstmm_complex_", text)
    text = _ZERO.sub(r"\1mstmm_complex_plain(0);", text)
    text = _ADDED.sub(_added, text)
    text = text.replace("_table[];", f"_table[{MOST_SPEEDS + 1}];").replace("extern ", "")
    return _OWN.sub("static ", text)


def _added(found: re.Match[str]) -> str:
    indent, to, sign, value = found.groups()
    word = "plus" if sign == "+" else "minus"
    return f"{indent}{to} = mstmm_complex_{word}({to}, {value});"
