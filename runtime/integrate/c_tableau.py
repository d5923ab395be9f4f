"""Coefficients of a method as the C struct of the integration loop."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from mstmm.array_validation import Array

from .steppers import Tableau
from .steppers.alpha_family import NewmarkFamily
from .steppers.implicit_methods import Implicit, Rosenbrock


@cache
def c_tableau(ffi: Any, tableau: Tableau) -> Any:
    """`mstmm_tableau *` of a method; it and its arrays exist until the program ends."""
    record, kept_arrays = ffi.new("mstmm_tableau *"), list[Any]()

    def doubles(array: Array) -> Any:
        kept_arrays.append(np.array(array, dtype=np.float64, order="C"))
        return ffi.from_buffer("double[]", kept_arrays[-1])

    def integers(values: Sequence[int]) -> Any:
        kept_arrays.append(ffi.new("int[]", values or 1))
        return kept_arrays[-1]

    for name in ("n_stages", "n_extra", "n_dense", "error_order", "beta"):
        setattr(record, name, getattr(tableau, name))
    record.n_errors = (tableau.E is not None) + (tableau.E_low is not None)
    starts, columns, weights = tableau.rows
    record.starts, record.columns = integers(starts), integers(columns)
    record.weights = doubles(weights)
    record.c, record.c_extra = doubles(tableau.C), doubles(tableau.C_extra)
    record.stability_limit = tableau.real_stability_limit
    record.n_nodes, record.n_iterations = tableau.iterated or (0, 0)
    record.mix, record.is_read = doubles(tableau.block_weights), integers(tableau.shared_blocks)
    if isinstance(tableau, Implicit):
        record.kind, record.gamma = tableau.kind, tableau.gamma
        record.n_inner, record.inner = len(tableau.inner_nodes), doubles(tableau.inner_nodes)
        record.quadrature = doubles(tableau.quadrature)
        record.roughness = doubles(tableau.roughness)
    if isinstance(tableau, Rosenbrock):
        record.d = doubles(tableau.d)
    if isinstance(tableau, NewmarkFamily):
        for name in ("alpha_m", "alpha_f", "beta_n", "gamma_n", "collocation", "error_constant"):
            setattr(record, name, getattr(tableau, name))
        record.backward, record.one_iteration = tableau.backward, tableau.one_iteration
    _kept_arrays.append(kept_arrays)
    return record


_kept_arrays: list[list[Any]] = []
