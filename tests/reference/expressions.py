"""Own small reader of the scene's expressions, by Python's syntax tree (never `eval`)."""

from __future__ import annotations

import ast
import operator
from collections.abc import Mapping
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
_NAMES = "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt sign"
_FUNCTIONS: dict[str, Any] = {name: getattr(mpmath, name) for name in _NAMES.split()} | {
    "abs": abs,
    "min": min,
    "max": max,
    "where": lambda c, a, b: a if c else b,
}


def evaluate(text: Any, scope: Mapping[str, Any]) -> Any:
    """Value of a number or expression; `scope` maps names (and `name.q`) to numbers or lists."""
    if not isinstance(text, str):
        return text
    return _visit(ast.parse(text.replace("^", "**").strip(), mode="eval").body, scope)


def number(text: Any, scope: Mapping[str, Any]) -> float:
    """`evaluate` as a float."""
    return float(evaluate(text, scope))


def drive(text: Any, t: float) -> tuple[float, float, float]:
    """Value, first and second derivative of an expression in t, differentiated at 60 digits."""
    with mpmath.workdps(60):
        value, rate, second = mpmath.taylor(lambda s: mpmath.mpf(evaluate(text, {"t": s})), t, 2)
        return float(value), float(rate), float(2 * second)


def _scalar(value: Any) -> Any:
    return value[0] if hasattr(value, "__len__") and len(value) == 1 else value


def _visit(node: ast.AST, scope: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant):
        return mpmath.mpf(repr(node.value))
    if isinstance(node, ast.Name):
        return mpmath.pi if node.id == "pi" else _scalar(scope[node.id])
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
        return _FUNCTIONS[node.func.id](*arguments)  # type: ignore[attr-defined]
    raise ValueError(f"not in the grammar: {ast.unparse(node)}")
