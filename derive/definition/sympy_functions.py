"""Functions of SymPy that definitions may use, by the operation of the IR that computes them."""

from __future__ import annotations

import sympy as sp

from mstmm.ir import OPERATIONS

FUNCTIONS: dict[type, str] = {
    getattr(sp, row.sympy): row.name for row in OPERATIONS.values() if row.sympy
}
