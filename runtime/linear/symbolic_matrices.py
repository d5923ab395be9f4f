"""Matrices of a linear model as symbolic expressions in kept names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, eq=False)
class SymbolicLinearModel:
    """M x'' + C x' + K x = V v + W w with SymPy matrices; rows and units as in `Linear`.

    Attributes:
        M, C, K, V, W: `sympy.ImmutableMatrix` in the kept symbols; columns as in `Linear`.
        symbols: `sympy.Symbol` by name.
        symbol_values: value of each symbol in the scene or state, SI units; `M.subs(numbers)` is
            the matrix of the linear model.
        coordinate_names: names of x.
        input_names, disturbance_names: names of v and w.
    """

    M: Any = field(repr=False)
    C: Any = field(repr=False)
    K: Any = field(repr=False)
    V: Any = field(repr=False)
    W: Any = field(repr=False)
    symbols: Mapping[str, Any]
    symbol_values: Mapping[Any, float]
    coordinate_names: tuple[str, ...]
    input_names: tuple[str, ...] = ()
    disturbance_names: tuple[str, ...] = ()
