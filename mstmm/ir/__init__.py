"""KernelIR: intermediate representation between derived equations and executable code.

A kernel is a list of scalar statements in single-assignment order over typed inputs and outputs.
It holds text and integers only (no SymPy), is frozen and hashable, and is stored as JSON.

Shapes are integers, or one declared size symbol `n` (modal sizes).  With `n` present there are
exactly three loops: an indexed sum over k < n or l < n, a store over k, l or both, and the
primitive `solve`.  A sum may be nested in a loop over the other letter, so that loops are at most
two deep.  There are no branches except `select` and guards.

With `n` present an output that is complete (every entry stored, or solved for) and does not
accumulate may be read by later statements.
"""

from __future__ import annotations

from .kernel import KernelIR, assignments, check, from_json, to_json
from .operations import OPERATIONS
from .statements import (
    INNER_INDEX,
    LOOP_INDEX,
    LOOPS,
    Assign,
    Constant,
    Element,
    Guard,
    Inner,
    Operand,
    Port,
    Solve,
    Statement,
    Store,
    Sum,
    Temporary,
)

__all__ = [
    "INNER_INDEX", "LOOPS", "LOOP_INDEX", "OPERATIONS", "Assign", "Constant", "Element", "Guard",
    "Inner", "KernelIR", "Operand", "Port", "Solve", "Statement", "Store", "Sum", "Temporary",
    "assignments", "check", "from_json", "to_json",
]  # fmt: skip
