"""Results of a definition's methods, validated as matrices of expressions.

A definition is user code: a method may raise, return nothing, or use functions without counterpart
in C.  Each such error becomes an ElementError that names element and method.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp
from sympy.functions.elementary.piecewise import ExprCondPair
from sympy.logic.boolalg import Boolean

from mstmm.errors import ElementError, MstmmError

from .sympy_functions import FUNCTIONS

#: Expression nodes, apart from functions, that the IR has operations for.
_NODES = (
    sp.Add, sp.Mul, sp.Pow, sp.Min, sp.Max, sp.Piecewise, ExprCondPair, sp.Symbol, sp.Rational,
    sp.Float, Boolean,
)  # fmt: skip


def matrix(
    where: str, what: str, method: Callable[..., Any], shape: tuple[int, int], *arguments: Any
) -> sp.Matrix:
    """`method(*arguments)` as a matrix of this shape.  Raises ElementError."""
    if 0 in shape:
        return sp.zeros(*shape)
    found = as_matrix(where, what, _call_method(where, what, method, *arguments))
    if found.shape != shape:
        raise ElementError(
            f"{where}: {what} must be {shape[0]} x {shape[1]}, found {found.rows} x {found.cols}"
        )
    return found


def as_matrix(where: str, what: str, value: Any) -> sp.Matrix:
    """A SymPy matrix, a nested list or a numpy array as a matrix of real expressions."""
    if value is None:
        raise ElementError(f"{where}: {what} returns nothing; is there a `return`?")
    try:
        if isinstance(value, (str, bytes)) or not hasattr(value, "__len__"):
            raise TypeError
        found = sp.Matrix(value)
    except Exception:
        raise ElementError(
            f"{where}: {what} must be a matrix (sympy.Matrix or a list), found {_short_text(value)}"
        ) from None
    for entry in found:
        _reject_unknown(where, what, entry)
    return found


def scalar(where: str, what: str, method: Callable[..., Any], *arguments: Any) -> sp.Expr:
    """`method(*arguments)` as one expression.  Raises ElementError."""
    value = _call_method(where, what, method, *arguments)
    if value is None:
        raise ElementError(f"{where}: {what} returns nothing; is there a `return`?")
    try:
        found = sp.sympify(value, strict=True)
    except Exception:
        found = None
    if not isinstance(found, sp.Expr) or getattr(found, "is_Matrix", False):
        raise ElementError(f"{where}: {what} must be one expression, found {_short_text(value)}")
    _reject_unknown(where, what, found)
    return found


def optional(
    where: str, what: str, method: Callable[..., Any], *arguments: Any
) -> sp.Matrix | None:
    """A matrix of any shape, or None if the definition leaves it to the derivation."""
    value = _call_method(where, what, method, *arguments)
    return None if value is None else as_matrix(where, what, value)


def pair(
    where: str, what: str, method: Callable[..., Any], *arguments: Any
) -> tuple[sp.Matrix, sp.Matrix]:
    """Two 3 x 1 matrices, force and moment, returned by `method(*arguments)`."""
    value = _call_method(where, what, method, *arguments)
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise ElementError(
            f"{where}: {what} must return two 3 x 1 matrices, force and moment, "
            f"found {_short_text(value)}"
        )
    force = as_matrix(where, f"the force of {what}", value[0])
    moment = as_matrix(where, f"the moment of {what}", value[1])
    if force.shape != (3, 1) or moment.shape != (3, 1):
        raise ElementError(
            f"{where}: {what} must return two 3 x 1 matrices, force and moment, found "
            f"{force.rows} x {force.cols} and {moment.rows} x {moment.cols}"
        )
    return force, moment


def _call_method(where: str, what: str, method: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return method(*arguments)
    except MstmmError:
        raise
    except NotImplementedError:
        raise ElementError(f"{where}: {what} is missing; the definition must define it") from None
    except Exception as error:
        hint = ""
        if "convert expression to float" in str(error) or "loop of ufunc" in str(error):
            hint = "; take functions from sympy (sympy.sin), not from math or numpy"
        cause = f"{type(error).__name__}: {error}".rstrip(": ")
        raise ElementError(f"{where}: {what} failed with {cause}{hint}") from error


def _short_text(value: Any) -> str:
    """Representation of a value on one line of at most 80 characters, for messages."""
    return f"{' '.join(repr(value).split()):.80}"


def _reject_unknown(where: str, what: str, entry: Any) -> None:
    """Reject parts of an expression that are not real and finite, or unknown to the IR."""
    for node in sp.preorder_traversal(entry):
        if node.has(sp.nan, sp.zoo, sp.oo, -sp.oo) and not node.args:
            raise ElementError(f"{where}: {what} must be finite, found {node}")
        if node is sp.I:
            raise ElementError(f"{where}: {what} must be real, found the imaginary unit")
        if isinstance(node, sp.Piecewise) and node.args[-1][1] != sp.true:
            raise ElementError(
                f"{where}: {what} contains a Piecewise without a last case; add (value, True)"
            )
        if node is sp.pi or isinstance(node, (*_NODES, *FUNCTIONS)):
            continue
        names = ", ".join(sorted(str(f.__name__).lower() for f in FUNCTIONS))
        name = getattr(type(node), "__name__", str(node))
        raise ElementError(
            f"{where}: {what} contains the unknown function {name}; expected one of {names}, "
            "sqrt, powers, Min, Max, Piecewise"
        )
