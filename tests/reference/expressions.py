"""Own small reader of the scene's expressions, by Python's syntax tree (never `eval`)."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import mpmath

_BINARY: dict[type, Any] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_COMPARE: dict[type, Any] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
}
_NAMES = ["sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp"]
_NAMES += ["log", "sqrt"]
_OWN: dict[str, Any] = {
    "abs": abs,
    "min": min,
    "max": max,
    "sign": lambda x: (x > 0) - (x < 0),
    "where": lambda condition, a, b: a if condition else b,
}
_FLOAT = _OWN | {name: getattr(math, name) for name in _NAMES} | {"pi": math.pi}
_EXACT = _OWN | {name: getattr(mpmath, name) for name in _NAMES} | {"pi": mpmath.pi}


def evaluate(text: Any, scope: Mapping[str, Any], functions: Mapping[str, Any] = _FLOAT) -> Any:
    """Value of a number or expression; `scope` maps names (and `name.q`) to numbers or lists."""
    if not isinstance(text, str):
        return text
    return _visit(_syntax_tree(text), {**functions, **scope})


@lru_cache(maxsize=1000)
def _syntax_tree(text: str) -> ast.AST:
    return ast.parse(text.replace("^", "**").strip(), mode="eval").body


def number(text: Any, scope: Mapping[str, Any]) -> float:
    """`evaluate` as a float."""
    return float(evaluate(text, scope))


def drive(text: Any, t: float) -> tuple[float, float, float]:
    """Value, first and second derivative of an expression in t, differentiated at 60 digits."""
    with mpmath.workdps(60):
        at = lambda s: mpmath.mpf(evaluate(text, {"t": s}, _EXACT))  # noqa: E731
        value, rate, second = mpmath.taylor(at, t, 2)
        return float(value), float(rate), float(2 * second)


def _scalar(value: Any) -> Any:
    return value[0] if hasattr(value, "__len__") and len(value) == 1 else value


def _visit(node: ast.AST, scope: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.Name):
        return _scalar(scope[node.id])
    if isinstance(node, ast.Attribute):
        return _scalar(scope[f"{node.value.id}.{node.attr}"])  # type: ignore[attr-defined]
    if isinstance(node, ast.Subscript):
        key = ast.unparse(node.value)
        return scope[key][int(_visit(node.slice, scope))]
    if isinstance(node, ast.UnaryOp):
        value = _visit(node.operand, scope)
        return -value if isinstance(node.op, ast.USub) else value
    if isinstance(node, ast.BinOp):
        return _BINARY[type(node.op)](_visit(node.left, scope), _visit(node.right, scope))
    if isinstance(node, ast.Compare):
        return _COMPARE[type(node.ops[0])](
            _visit(node.left, scope), _visit(node.comparators[0], scope)
        )
    if isinstance(node, ast.Call):
        arguments = [_visit(a, scope) for a in node.args]
        return scope[node.func.id](*arguments)  # type: ignore[attr-defined]
    raise ValueError(f"not in the grammar: {ast.unparse(node)}")
