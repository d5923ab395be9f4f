"""The small grammar: meaning, names, time breaks, and a clear refusal of everything else."""

from __future__ import annotations

import math
import pickle
import sys

import pytest

from mstmm.errors import ExpressionError
from mstmm.expression.derivatives import node_value
from mstmm.expression.expression import Expression, Name, number, parse
from mstmm.expression.parser import FUNCTIONS
from mstmm.ir.graph import Graph, Node
from tests.support.work import calls

T, X, Y = 0.37, 1.9, -0.6
VALUES = {"t": T, "x": X, "y": Y, "q[1]": 2.5, "arm.q": 0.2, "rod1.tip.vx": -3.0}

MEANINGS = [
    ("1 + 2*3 - 4/8", 6.5),
    ("2^3^2", 512.0),
    ("-2^2", -4.0),
    ("2^-1", 0.5),
    ("2^-x^2", 2 ** -(X**2)),
    ("--3", 3.0),
    ("+4 - +1", 3.0),
    ("-x*y", -X * Y),
    ("x-y-t", X - Y - T),
    ("x/y/t", X / Y / T),
    ("(x - y)*t", (X - Y) * T),
    ("1e3 + .5 + 2. + 1E-2", 1002.51),
    ("sin(x)*cos(y) + tan(t)", math.sin(X) * math.cos(Y) + math.tan(T)),
    ("asin(t) + acos(t) - pi/2", 0.0),
    ("atan(y) - atan2(y, x)", math.atan(Y) - math.atan2(Y, X)),
    ("atan2(y, -x)", math.atan2(Y, -X)),
    ("sinh(t) + cosh(t) - exp(t)", 0.0),
    ("tanh(x)", math.tanh(X)),
    ("log(exp(x))", X),
    ("sqrt(x^2)", X),
    ("abs(y) + sign(y)", 0.6 - 1),
    ("min(x, y) + max(x, y)", X + Y),
    ("min(3, x, y, t)", Y),
    ("max(x, min(y, t, 1), 0)", X),
    ("where(t < 1, x, y)", X),
    ("where(t >= 1, x, y)", Y),
    ("where(x > y, where(t <= 0.37, 1, 2), 3)", 1.0),
    ("where(1 < 2, t, 7)", T),
    ("x^0.5 - sqrt(x)", 0.0),
    ("x^7/(x*x*x*x*x*x*x)", 1.0),
    ("x^-2 * x^2", 1.0),
    ("q[1] + arm.q*rod1.tip.vx", 2.5 - 0.6),
    (" \n t\t", T),
    ("where ( t<1 , 1 , 2 )", 1.0),
]


def through_the_graph(expression: Expression) -> float:
    graph = Graph()

    def resolve(name: Name) -> Node:
        return graph.element(name.text)

    node = expression.build(graph, resolve)
    return node_value(node, lambda leaf: VALUES[leaf.leaf.port])  # type: ignore[union-attr]


@pytest.mark.parametrize(("text", "expected"), MEANINGS)
def test_value_directly_and_through_the_graph(text: str, expected: float) -> None:
    expression = parse(text)
    assert expression.evaluate(lambda n: VALUES[n.text]) == pytest.approx(expected, abs=1e-14)
    assert through_the_graph(expression) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize(
    "text",
    [
        "where(log(y) > 0, 1, 2)", "where(log(y) >= 0, 1, 2)", "where(log(y) < 0, 1, 2)",
        "where(log(y) <= 0, 1, 2)", "where(0 < sqrt(y), 1, 1)", "where(t > asin(x), t, 2*t)",
        "where(y^0.5 < 1, 1, 2) + 3", "where(x > 0, where(1 < log(y), 1, 2), 3)",
        "where(where(log(y) > 0, 1, 2) > 0, 1, 2)",
    ],
)  # fmt: skip
def test_a_choice_by_a_comparison_that_is_no_number_is_none(text: str) -> None:
    expression = parse(text)
    assert math.isnan(expression.evaluate(lambda n: VALUES[n.text]))
    assert math.isnan(through_the_graph(expression))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("where(exp(1000*x) > 1, 3, 4)", 3.0),
        ("where(exp(1000*x) <= 1, 3, 4)", 4.0),
        ("where(-exp(1000*x) < exp(900*x), 3, 4)", 3.0),
        ("where(log(x) > 0, 3, 4)", 3.0),
        ("where(log(x) < 0, 3, 4)", 4.0),
        ("where(x > 0, 3, log(y))", 3.0),
        ("where(y > 0, log(y), where(y > -1, 5, log(y)))", 5.0),
    ],
)
def test_a_choice_by_numbers_and_infinities(text: str, expected: float) -> None:
    expression = parse(text)
    assert expression.evaluate(lambda n: VALUES[n.text]) == expected
    assert through_the_graph(expression) == expected


def test_every_function_of_the_grammar_is_covered_above() -> None:
    text = " ".join(t for t, _ in MEANINGS)
    assert [f for f in FUNCTIONS if f"{f}(" not in text.replace(" (", "(")] == []


def test_names_in_order_each_once() -> None:
    names = parse("b.q[1] + t*a.u - b.q[1] + body.end.vx + p").names
    assert [n.text for n in names] == ["b.q[1]", "t", "a.u", "body.end.vx", "p"]
    assert names[0] == Name(("b", "q"), 1)
    assert (names[0].owner, names[0].quantity, names[0].index) == ("b", "q", 1)
    assert (names[4].owner, names[4].quantity) == ("", "p")


@pytest.mark.parametrize(
    ("text", "constant", "time_only"),
    [
        ("2*pi", True, True),
        ("sin(t)", False, True),
        ("q + t", False, False),
        ("t[0]", False, False),
    ],
)
def test_what_it_depends_on(text: str, constant: bool, time_only: bool) -> None:
    expression = parse(text)
    assert expression.is_constant is constant
    assert expression.depends_on_time_only is time_only
    assert (expression.constant is not None) is constant


def test_comparison_is_taken_apart() -> None:
    comparison = parse("(rod1.x + 2)*t >= arm.q").comparison
    assert comparison is not None
    left, symbol, right = comparison
    assert (left.text, symbol, right.text) == ("(rod1.x + 2)*t", ">=", "arm.q")
    assert [n.text for n in left.names] == ["rod1.x", "t"]
    assert [n.text for n in right.names] == ["arm.q"]
    assert left.evaluate(lambda n: {"rod1.x": 1.0, "t": 3.0}[n.text]) == 9.0
    assert parse("(t < 1)").comparison is not None
    assert parse("where(t < 1, 1, 0)").comparison is None


@pytest.mark.parametrize(
    ("text", "breaks"),
    [
        ("where(t < 1, 0, 1)", (1.0,)),
        ("2*t - 1 >= 0", (0.5,)),
        ("(3 - t)/4 > 0.5*t", (1.0,)),
        ("abs(t - 2) + sign(1 - 4*t)", (0.25, 2.0)),
        ("min(t, 3, 5)", (3.0,)),
        ("max(2*t, t + 1)", (1.0,)),
        ("where(t < pi, 1, 0)", (math.pi,)),
        ("where(t <= 0.1, 1, 0)", (0.1,)),
        ("where(-t < -0.3, 1, 0)", (0.3,)),
        ("where(t*(1/3) < 1, t, where(t < 5, 2, 3))", (3.0, 5.0)),
        ("sin(abs(2*t - 1))", (0.5,)),
        ("t", ()),
        ("abs(sin(t))", ()),
        ("where(t^2 < 1, 1, 0)", ()),
        ("where(q < 1, 1, 0)", ()),
        ("where(q*t < 1, 1, 0)", ()),
        ("where(t - t < 1, 1, 0)", ()),
        ("where(0*t < 1, 1, 0)", ()),
        ("abs(-3)", ()),
    ],
)  # fmt: skip
def test_time_breaks_are_exact(text: str, breaks: tuple[float, ...]) -> None:
    assert parse(text).time_breaks() == breaks


BAD = [
    ("", "empty"),
    ("   ", "empty"),
    ("1 +", "ends where a value is expected"),
    ("-", "ends where a value is expected"),
    ("* 2", "a value is expected before *"),
    ("2 * / 3", "a value is expected before /"),
    ("2t", "write * for a product (character 2: 2 -->t)"),
    ("2 3", "an operator is missing"),
    ("(1)(2)", "an operator is missing"),
    ("t(1)", "unknown function 't'"),
    ("sn(t)", "did you mean sin?"),
    ("Sin(t)", "did you mean sin?"),
    ("heaviside(t)", "the functions are sin, cos"),
    ("sin", "sin needs its argument in parentheses"),
    ("sin t", "sin needs its argument in parentheses"),
    ("sin()", "a value is missing before )"),
    ("()", "a value is missing before )"),
    ("sin(1, 2)", "sin: expected one argument, found 2"),
    ("atan2(1)", "atan2: expected 2 arguments, found 1"),
    ("min(1)", "min: expected two or more arguments, found 1"),
    ("where(t < 1, 2)", "where: expected 3 arguments, found 2"),
    ("where(t, 1, 2)", "begins with a comparison such as t < 1"),
    ("(t < 1)*2", "write where(condition, 1, 0)"),
    ("sin(t < 1)", "write where(condition, 1, 0)"),
    ("where(t < 1, t < 2, 0)", "write where(condition, 1, 0)"),
    ("0 < t < 1", "comparisons cannot be chained"),
    ("t == 1", "one of < <= > >="),
    ("t = 1", "one of < <= > >="),
    ("t != 1", "one of < <= > >="),
    ("2**3", "write ^ for a power"),
    ("2 ** 3", "write ^ for a power"),
    ("3,5", "write decimals with a point"),
    ("(1, 2)", "write decimals with a point"),
    ("(1", "not closed"),
    ("sin(1", "not closed"),
    ("1)", "has no opening one"),
    ("q[-1]", "an index follows its name directly"),
    ("q[i]", "an index follows its name directly"),
    ("q [0]", "an index follows its name directly"),
    ("a.b.c.d.e", "at most four parts"),
    ("a" * 65, "at most 64 characters"),
    ("a..b", "not part of an expression"),
    ("t.", "not part of an expression"),
    ("1e999", "too large"),
    ("9" * 400, "too large"),
    ("1e-999", "too small"),
    ("1/0", "division by zero"),
    ("t/0", "division by zero"),
    ("t/(2 - 2)", "division by zero"),
    ("sqrt(-1)", "no finite real value"),
    ("log(0)", "no finite real value"),
    ("asin(2)", "no finite real value"),
    ("(-8)^(1/3)", "this power has no finite real value"),
    ("0^-1", "no finite real value"),
    ("1e200*1e200", "this product has no finite real value"),
    ("10^400", "no finite real value"),
    ("9^9^9^9", "no finite real value"),
    ("exp(1000)", "no finite real value"),
    ("__import__('os')", "unknown function '__import__'"),
    ("lambda: 1", "not part of an expression"),
    ("t if t else 1", "an operator is missing"),
    ("'text'", "cannot contain text"),
    ("t; t", "not part of an expression"),
    ("t#1", "not part of an expression"),
    ("t@1", "not part of an expression"),
    ("\N{GREEK SMALL LETTER THETA}", "not part of an expression"),
    ("3 \N{MINUS SIGN} 2", "write the plain - of the keyboard"),
    ("3\N{MIDDLE DOT}2", "write * for a product"),
    ("\N{FULLWIDTH DIGIT ONE}", "not part of an expression"),
    ("1\x00", "not part of an expression"),
    ("t" * 4001, "the limit is 4000"),
    ("(" * 101 + "t" + ")" * 101, "more than 100 nested parentheses"),
    ("sin(" * 101 + "t" + ")" * 101, "more than 100 nested parentheses"),
]


@pytest.mark.parametrize(("text", "fragment"), BAD)
def test_refused_in_one_printable_line(text: str, fragment: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse(text, 'arm.toml: hinge "a": drive')
    message = str(caught.value)
    assert message.startswith('arm.toml: hinge "a": drive: ')
    assert fragment in message
    assert message.isprintable()
    assert len(message) < 400


def test_position_is_marked() -> None:
    with pytest.raises(ExpressionError, match=r"\(character 7: 0\.5 \+  -->sn\(3\*t\)\)"):
        parse("0.5 + sn(3*t)")


def test_not_text() -> None:
    with pytest.raises(ExpressionError, match="expected an expression as text, found float"):
        parse(1.0)  # type: ignore[arg-type]


def through(text: str) -> tuple[Expression, Node]:
    """All that becomes of a text on its way to C."""
    expression = parse(text)
    graph = Graph()
    node = expression.build(graph, lambda name: graph.element(name.text))
    expression.time_breaks()
    return expression, node


@pytest.mark.parametrize(
    "text",
    [
        "-" * 3999 + "t",
        "+".join(["t"] * 2000),
        "*".join(["t"] * 2000),
        "^".join(["t"] * 2000),
        "t" + "-t^2" * 999,
        "(" * 100 + "t" + ")" * 100,
        "sin(" * 100 + "t" + ")" * 100,
        "min(" + ",".join(["t"] * 1990) + ")",
        "t*1e-300" * 1 + "*1.1e-300" * 400,
        "1.0000001" + "^16" * 1 + "*t",
        "where(t<1," * 100 + "t" + ",0)" * 100,
    ],
)
def test_long_and_deep_texts_need_no_stack(text: str) -> None:
    """Everything works with a tenth of Python's usual stack to spare."""
    limit = sys.getrecursionlimit()
    frames, frame = 0, sys._getframe()
    while frame.f_back is not None:
        frames, frame = frames + 1, frame.f_back
    sys.setrecursionlimit(frames + 120)
    try:
        expression, node = through(text)
    finally:
        sys.setrecursionlimit(limit)
    assert node_value(node, lambda _: 0.5) == pytest.approx(
        expression.evaluate(lambda _: 0.5), rel=1e-12, nan_ok=True
    )
    assert calls(lambda: through(text)) < 200 * len(text)  # at most 93 for each character


def test_towers_of_exact_powers_stay_short() -> None:
    text = "1.0000001"
    for _ in range(6):
        text = f"({text})^16"
    expression = parse(f"t*{text}")
    assert expression.evaluate(lambda _: 1.0) == pytest.approx(1.0000001 ** (16**6), rel=1e-9)


def test_equal_texts_are_equal_and_hashable() -> None:
    assert parse("t + 1") == parse(" t + 1 ")
    assert parse("t + 1") != parse("t+1")
    assert len({parse("t"), parse("t"), parse("q")}) == 2
    assert pickle.loads(pickle.dumps(parse("sin(t)"))) == parse("sin(t)")


@pytest.mark.parametrize("x", [0.0, -0.1, 1e-308, 1.7e308, -5e-324, 3.0])
def test_numbers_come_back_exactly(x: float) -> None:
    assert number(x).constant == x


def test_values_outside_the_domain_are_nan_or_infinite() -> None:
    def value_at(text: str, t: float) -> float:
        return parse(text).evaluate(lambda _: t)

    assert math.isnan(value_at("sqrt(t)", -1.0))
    assert math.isnan(value_at("t/t", 0.0))
    assert value_at("1/t", 0.0) == math.inf
    assert value_at("exp(t)", 1e4) == math.inf
    assert value_at("where(t > 0, 1/t, 5)", 0.0) == 5.0
