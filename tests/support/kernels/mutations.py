"""Derivations with one sign turned, to see that the checks notice."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import sympy as sp

from mstmm.derive.catalogue.kernels import Kernel
from mstmm.derive.definition.derivation import Derivation


def sign_variants(expression: sp.Basic) -> Iterator[sp.Basic]:
    """The expression with the sign of one summand turned, for every summand at its top."""
    if isinstance(expression, sp.BlockMatrix):
        for i in range(expression.blocks.rows):
            for j in range(expression.blocks.cols):
                for block in sign_variants(expression.blocks[i, j]):
                    rows = [list(expression.blocks.row(k)) for k in range(expression.blocks.rows)]
                    rows[i][j] = block
                    yield sp.BlockMatrix(rows)
    elif isinstance(expression, sp.MatrixBase):
        for place, entry in enumerate(expression):
            for term in sp.Add.make_args(entry):
                if term != 0:
                    changed = list(expression)
                    changed[place] = entry - 2 * term
                    yield sp.ImmutableDenseMatrix(*expression.shape, changed)
    else:
        terms = expression.args if isinstance(expression, sp.MatAdd) else (expression,)
        for term in terms:
            yield expression - 2 * term if len(terms) > 1 else -expression


def mutants(kernel: Kernel, quantity: str) -> list[Kernel]:
    """The kernel with one summand of the definition of `quantity` turned in sign, for each."""
    derivation = kernel.derivation
    place = next(i for i, e in enumerate(derivation.definitions) if str(e.left.name) == quantity)
    return [
        replace(kernel, derivation=_with(derivation, place, right))
        for right in sign_variants(derivation.definitions[place].right)
    ]


def _with(derivation: Derivation, place: int, right: sp.Basic) -> Derivation:
    definitions = list(derivation.definitions)
    definitions[place] = replace(definitions[place], right=right)
    return replace(derivation, definitions=tuple(definitions))
