"""Lowering of the definitions of a Derivation to a KernelIR."""

from __future__ import annotations

import sympy as sp

from mstmm.ir import KernelIR

from ..definition.derivation import Derivation
from .fixed_size import Lowering, port
from .variable_size import SizedLowering


def lower(
    derivation: Derivation, name: str, guards: tuple[tuple[sp.Basic, int, str], ...] = ()
) -> KernelIR:
    """KernelIR of the derivation's definitions.

    `guards` are (condition, failure code, message) over the derivation's quantities.
    Quantities with a run-time size are lowered as in `variable_size`.
    Raises NotImplementedError, naming the expression, for SymPy that has no counterpart in the IR.
    """
    size = derivation.size
    lowering = Lowering(derivation) if size is None else SizedLowering(derivation, size)
    for equation in derivation.definitions:
        lowering.define(equation)
    for condition, code, message in guards:
        lowering.graph.guard(lowering.scalar(condition), code, message)
    values: dict[str, object] = {
        q.name: lowering.stored_entries(q) for q in derivation.outputs if not q.has_runtime_size
    }
    return lowering.graph.kernel(
        name,
        [port(q) for q in derivation.inputs],
        [port(q) for q in derivation.outputs],
        values,
        size_symbol=None if size is None else str(size),
        purpose=derivation.title,
        sources=derivation.sources,
    )
