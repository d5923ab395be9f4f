"""SymPy functions that definitions may use -> IR operation that computes them."""

from __future__ import annotations

import sympy as sp

from mstmm.ir import OPERATIONS

FUNCTIONS: dict[type, str] = {
    getattr(sp, row.sympy): row.name for row in OPERATIONS.values() if row.sympy
}
