"""Random texts: the parser answers with an expression or an ExpressionError, never otherwise."""

from __future__ import annotations

import math

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mstmm.errors import ExpressionError
from mstmm.expression.derivatives import node_value
from mstmm.expression.expression import parse
from mstmm.ir.graph import Graph

PIECES = st.sampled_from(
    "0 1 2.5 1e3 1e308 1e999 .5 pi t q u q[0] arm.q[1] rod.tip.x sin( cos( atan2( min( max( where( "
    "sqrt( log( ( ) ) , + - * / ^ ** < <= > >= == [ ] . e é \x00 \n ' \\ { } lambda __x__".split(
        " "
    )
)
SOUP = st.lists(PIECES, max_size=40).map("".join)


def _number(x: float) -> str:
    return repr(abs(x))


ATOMS = st.one_of(
    st.floats(0, 100, allow_nan=False).map(_number), st.sampled_from(["t", "q", "pi", "arm.u[2]"])
)


def _grow(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    pair = st.tuples(inner, inner)
    return st.one_of(
        st.tuples(inner, st.sampled_from("+-*/^"), inner).map(lambda p: f"({p[0]} {p[1]} {p[2]})"),
        st.tuples(st.sampled_from("sin cos tanh exp abs sign atan".split()), inner).map(
            lambda p: f"{p[0]}({p[1]})"
        ),
        inner.map(lambda a: f"-{a}"),
        pair.map(lambda p: f"min({p[0]}, {p[1]})"),
        pair.map(lambda p: f"where({p[0]} < {p[1]}, {p[1]}, {p[0]})"),
    )


WELL_FORMED = st.recursive(ATOMS, _grow, max_leaves=25)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.one_of(SOUP, st.text(max_size=60)))
def test_any_text_parses_or_is_refused(text: str) -> None:
    try:
        expression = parse(text, "scene")
    except ExpressionError as error:
        assert str(error).startswith("scene: ")
        assert str(error).isprintable()
        return
    expression.time_breaks()
    graph = Graph()
    expression.build(graph, lambda name: graph.element(name.text))


#: Sums, products and functions of slope 1 at most, of few small numbers: well conditioned.
TAME = st.recursive(
    st.one_of(st.floats(0, 2).map(_number), st.sampled_from(["t", "q", "arm.u[2]"])),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda p: f"({p[0]} {p[1]} {p[2]})"),
        st.tuples(st.sampled_from("sin cos tanh atan abs -".split()), inner).map(
            lambda p: f"{p[0]}({p[1]})"
        ),
        st.tuples(inner, inner).map(lambda p: f"min({p[0]}, max({p[1]}, 1/2), {p[0]}^2)"),
    ),
    max_leaves=8,
)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(TAME, st.floats(-2, 2), st.floats(-2, 2))
def test_graph_and_direct_evaluation_agree(text: str, t: float, q: float) -> None:
    expression = parse(text)
    numbers = {"t": t, "q": q, "arm.u[2]": 0.7}
    direct = expression.evaluate(lambda n: numbers[n.text])
    graph = Graph()
    node = expression.build(graph, lambda name: graph.element(name.text))
    built = node_value(node, lambda leaf: numbers[leaf.leaf.port])  # type: ignore[union-attr]
    assert math.isclose(direct, built, rel_tol=1e-9, abs_tol=1e-9), text


@settings(max_examples=200, deadline=None)
@given(WELL_FORMED)
def test_names_are_those_of_the_text(text: str) -> None:
    try:
        expression = parse(text)
    except ExpressionError:
        return
    for name in expression.names:
        assert text[name.position :].startswith(name.text)
    assert {n.text for n in expression.names} <= {"t", "q", "arm.u[2]"}
