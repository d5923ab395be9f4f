"""Coefficients of a method as the C struct of the integration loop."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from mstmm.arrays import Array

from .steppers import Tableau
from .steppers.implicit import Alpha, Implicit, Rosenbrock


@cache
def c_tableau(ffi: Any, tableau: Tableau) -> Any:
    """`mstmm_tableau *` of a method; it and its arrays exist until the program ends."""
    t, kept = ffi.new("mstmm_tableau *"), list[Any]()

    def doubles(array: Array) -> Any:
        kept.append(np.array(array, dtype=np.float64, order="C"))
        return ffi.from_buffer("double[]", kept[-1])

    def integers(values: Sequence[int]) -> Any:
        kept.append(ffi.new("int[]", values or 1))
        return kept[-1]

    t.n_stages, t.n_extra, t.n_dense = tableau.n_stages, tableau.n_extra, tableau.n_dense
    t.n_errors = (tableau.E is not None) + (tableau.E_low is not None)
    t.error_order, t.beta = tableau.error_order, tableau.beta
    starts, columns, weights = tableau.rows
    t.starts, t.columns, t.weights = integers(starts), integers(columns), doubles(weights)
    t.c, t.c_extra = doubles(tableau.C), doubles(tableau.C_extra)
    t.stability_limit = tableau.real_stability_limit
    t.n_nodes, t.n_iterations = tableau.iterated or (0, 0)
    t.mix, t.is_read = doubles(tableau.mix), integers(tableau.read_blocks)
    if isinstance(tableau, Implicit):
        t.kind, t.gamma = tableau.kind, tableau.gamma
        t.n_inner, t.inner = len(tableau.inner), doubles(tableau.inner)
        t.quadrature, t.roughness = doubles(tableau.quadrature), doubles(tableau.roughness)
    if isinstance(tableau, Rosenbrock):
        t.d = doubles(tableau.d)
    if isinstance(tableau, Alpha):
        for name in ("alpha_m", "alpha_f", "beta_n", "gamma_n", "collocation", "error_constant"):
            setattr(t, name, getattr(tableau, name))
        t.backward, t.one_iteration = tableau.backward, tableau.one_iteration
    _tableaus_kept.append(kept)
    return t


_tableaus_kept: list[list[Any]] = []
