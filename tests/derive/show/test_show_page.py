"""`mstmm show`: every stage in every format parses and says units and sources."""

from __future__ import annotations

import re
from functools import cache
from xml.etree import ElementTree

import pytest
import sympy as sp

from mstmm.derive.classical.catalogue import CLASSICAL, DISCRETE_DERIVATIONS, classical_spec
from mstmm.derive.codegen.template_rendering import element_source
from mstmm.derive.definition.derivation import Derivation, Equation, Quantity, Solve, tilde, vector
from mstmm.derive.definition.notation import Matrix, Tilde, explicit
from mstmm.derive.equations.rigid_body import rigid_body
from mstmm.derive.show.formula_layout import layout
from mstmm.derive.show.markup import latex_text, mathml
from mstmm.derive.show.plain_text import WIDTH, column_count, wrap_formula
from mstmm.derive.show.show_page import FORMATS, STAGES, ElementView, show_view
from mstmm.derive.show.symbol_names import SymbolName, parse_name, unit_text
from mstmm.derive.show.vector_recognition import recognise_matrix
from mstmm.errors import ElementError

#: Acceleration form; test_show_page_discrete_matrices.py has the discrete-time form.
NAMES = sorted(set(CLASSICAL) - set(DISCRETE_DERIVATIONS))


@cache
def view(name: str) -> ElementView:
    if name not in CLASSICAL:
        raise ElementError(f"no element {name!r}")
    derivation = CLASSICAL[name]()
    return ElementView(
        name,
        derivation.title,
        (derivation,),
        lambda: classical_spec(name).kernels,
        lambda: element_source(classical_spec(name)),
    )


def body_view() -> ElementView:
    derivation = rigid_body(outputs=2, loads=1)
    return ElementView("rigid", derivation.title, (derivation,), tuple, str)


@pytest.mark.parametrize("at", STAGES)
@pytest.mark.parametrize("name", NAMES)
def test_text_fits_the_page_and_names_units_and_sources(name: str, at: str) -> None:
    text = show_view(view(name), at, "text")
    assert "source: Rui, Wang, Zhang" in text
    assert "N·m" in text and "m/s²" in text
    if at in ("equations", "matrix"):
        assert max(column_count(line) for line in text.splitlines()) <= WIDTH
        assert re.search(r"\(5\.\d\d\)", text.split("\n", 6)[-1])


@pytest.mark.parametrize("at", STAGES)
@pytest.mark.parametrize("name", NAMES)
def test_html_is_well_formed_and_self_contained(name: str, at: str) -> None:
    html = show_view(view(name), at, "html")
    root = ElementTree.fromstring(html.removeprefix("<!DOCTYPE html>\n"))
    assert root.tag == "html"
    assert "N·m" in html and "m/s²" in html
    assert "Source: Rui, Wang, Zhang" in html
    math = root.findall(".//{http://www.w3.org/1998/Math/MathML}math")
    assert len(math) >= len(view(name).derivations[0].outputs)
    assert not re.search(r"<script|<link|src=|@import|url\(", html)


@pytest.mark.parametrize("at", STAGES)
@pytest.mark.parametrize("name", NAMES)
def test_latex_is_balanced(name: str, at: str) -> None:
    source = show_view(view(name), at, "latex")
    assert r"N\,m" in source and r"m/s\textsuperscript{2}" in source
    assert "Rui, Wang, Zhang" in source
    assert_balanced(source)


def assert_balanced(source: str) -> None:
    """Braces, environments and \\left \\right pair up outside verbatim text."""
    source = re.sub(r"\\begin\{verbatim\}.*?\\end\{verbatim\}", "", source, flags=re.S)
    open_environments: list[str] = []
    for kind, name in re.findall(r"\\(begin|end)\{(\w+\*?)\}", source):
        if kind == "begin":
            open_environments.append(name)
        else:
            assert open_environments.pop() == name
    assert not open_environments
    depth = 0
    for brace in re.findall(r"(?<!\\)[{}]", source):
        depth += 1 if brace == "{" else -1
        assert depth >= 0
    assert depth == 0
    assert len(re.findall(r"\\left\W", source)) == len(re.findall(r"\\right\W", source))
    assert source.isascii() or not set(re.findall(r"[^\x00-\x7f]", source)) & set("−≤≥≠ωθητ̃")


def test_matrix_stage_shows_the_block_form() -> None:
    lines = show_view(view("body_spatial"), "matrix", "text").splitlines()
    start = next(k for k, line in enumerate(lines) if line.strip().startswith("transfer matrix"))
    rows = [line.split("⎢")[-1].strip(" ⎢⎥⎤⎦⎡⎣U=").split("  ") for line in lines[start + 1 :][:5]]
    cells = [[cell.strip() for cell in row if cell.strip()] for row in rows]
    assert cells[0] == ["I", "−r̃_IO", "0", "0", "b_O"]
    assert cells[1] == ["0", "I", "0", "0", "0"]
    assert cells[2] == ["M r̃_IO − M r̃_IC", "−M r̃_IO r̃_IC − J_I", "I", "−r̃_IO", "U⟨35⟩"]
    assert cells[3] == ["−M I", "M r̃_IC", "0", "I", "f_C − M b_C"]
    assert cells[4] == ["0", "0", "0", "0", "1"]
    text = "\n".join(lines)
    assert "U⟨35⟩ = M r̃_IO b_C + m_C + r̃_IC f_C − h_I − r̃_IO f_C" in text


def test_equations_stage_states_the_premises() -> None:
    text = show_view(view("body_spatial"), "equations", "text")
    assert "r̈_O = r̈_I + b_O − r̃_IO ω̇_I" in text
    assert "Newton, mass centre · (5.20)" in text


def test_ir_stage_lists_every_statement() -> None:
    text = show_view(view("ball"), "ir", "text")
    kernel = classical_spec("ball").kernels[0]
    assert len(re.findall(r"^t\d+ = ", text, flags=re.M)) == sum(kernel.operation_counts().values())
    assert "return code 2 unless" in text


def test_c_stage_is_the_generated_source() -> None:
    source = element_source(classical_spec("pin_planar"))
    assert source.strip() in show_view(view("pin_planar"), "c", "text")


@pytest.mark.parametrize("format", FORMATS)
def test_bodies_with_branches_are_shown(format: str) -> None:
    page = show_view(body_view(), "matrix", format)
    assert "mass" in page and len(page) > 1000


@pytest.mark.parametrize(
    ("at", "format", "name"),
    [("equation", "text", "ball"), ("ir", "pdf", "ball"), ("ir", "text", "hinge")],
)
def test_unknown_words_are_refused(at: str, format: str, name: str) -> None:
    with pytest.raises(ElementError, match=r"unknown (stage|format)|no element"):
        show_view(view(name), at, format)


# --- expressions ------------------------------------------------------------------------------

A, B, V, W = (vector(name, 3) for name in ("r_A", "b", "v", "omega"))
K = sp.MatrixSymbol("J_I", 3, 3)
M = sp.MatrixSymbol("M", 1, 1)[0, 0]
LONG = vector("motion", 9)

RECOGNISED = [
    2 * A - M * B,
    Tilde(A) * B - Tilde(W) * V,
    Tilde(W) ** 2 * A,
    Tilde(W) * K * W,
    K * W - 3 * A,
    K.T * V,
    M * Tilde(A) - Tilde(B),
    -K - M * Tilde(A) * Tilde(B),
    M * sp.Identity(3) + Tilde(A) * Tilde(A),
]


@pytest.mark.parametrize("expression", RECOGNISED, ids=str)
def test_vectors_are_found_again_in_explicit_matrices(expression: sp.MatrixExpr) -> None:
    spelled = explicit(expression)
    found = recognise_matrix(spelled)
    assert found is not None
    assert (explicit(found) - spelled).applyfunc(sp.expand) == sp.zeros(*spelled.shape)


def test_parts_and_unrecognised_matrices() -> None:
    part = Matrix([LONG[i, 0] for i in range(3, 6)])
    assert wrap_formula(layout(part), 0) == ["motion[4…6]"]
    assert recognise_matrix(explicit(A) + Matrix([1, 0, 0])) is None
    assert recognise_matrix(tilde(A) + sp.diag(1, 2, 3)) is None


def test_hidden_difference_is_not_recognised() -> None:
    """One wrong sign in a cross-product matrix keeps it explicit."""
    wrong = sp.Matrix(tilde(A))
    wrong[0, 1] = -wrong[0, 1]
    assert recognise_matrix(wrong) is None


Q, T = sp.Function("q1"), sp.Symbol("t")
X = sp.Symbol("x")
EXPRESSIONS = [
    (sp.diff(Q(T), T, 2) + sp.diff(Q(T), T), "q̈_1 + q̇_1", r"\ddot{q}_{1} + \dot{q}_{1}"),
    (X < 3, "x < 3", "x < 3"),
    (sp.Rational(-1, 2) * X, "−x / 2", r"-\frac{x}{2}"),
    (sp.sqrt(X + 1), "√(x + 1)", r"\sqrt{x + 1}"),
    (X**-2, "1 / x²", r"\frac{1}{{x}^{2}}"),
    (sp.Abs(X), "|x|", r"\left|x\right|"),
    (sp.Max(X, 1), "max(1, x)", r"\max\left(1,  x\right)"),
    (Tilde(A + B) * V, "(r_A + b)~ v", None),
    (Solve(K, A), "J_I⁻¹ r_A", r"{J_{I}}^{-1}\,r_{A}"),
    (sp.And(X > 0, X < 1), "x > 0 and x < 1", None),
]


@pytest.mark.parametrize(("expression", "text", "tex"), EXPRESSIONS, ids=lambda e: str(e)[:30])
def test_expression_in_every_format(expression: sp.Basic, text: str, tex: str | None) -> None:
    node = layout(expression)
    assert sorted("".join(wrap_formula(node, 0)).replace(" ", "")) == sorted(text.replace(" ", ""))
    source = latex_text(node)
    assert_balanced(source)
    if tex is not None and not isinstance(expression, sp.Add):
        assert source.replace(" ", "") == tex.replace(" ", "")
    ElementTree.fromstring(mathml(node))


def test_choice_has_branches_in_every_format() -> None:
    node = layout(sp.Piecewise((X, X < 1), (1, True)))
    assert wrap_formula(node, 0) == ["⎧ x  if x < 1", "⎩ 1  otherwise"]
    assert r"\begin{cases}" in latex_text(node)
    assert "&lt;" in mathml(node)


def test_wide_choices_and_shared_terms_still_fit_the_page() -> None:
    x, y = (sp.MatrixSymbol(name, 4, 4) for name in ("x", "y"))
    big = sum(sp.sqrt(1 + x[i, j] ** 2) * y[j, i] for i in range(4) for j in range(4))
    choice = sp.Piecewise((big**3, big > 0), (-big, True)) + big
    out = vector("out", 3)
    derivation = Derivation(
        "wide",
        "wide expressions",
        (Quantity(x, "m"), Quantity(y, "kg")),
        (Quantity(out, "N"),),
        (Equation("out", out, Matrix([big, choice, choice**2])),),
    )
    wide = ElementView("wide", "wide", (derivation,), tuple, str)
    text = show_view(wide, "equations", "text")
    assert max(column_count(line) for line in text.splitlines()) <= WIDTH
    assert "c_1 = " in text and "otherwise" in text
    assert_balanced(show_view(wide, "equations", "latex"))


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("rdd_IO", SymbolName("r", 2, "IO")),
        ("omegadot", SymbolName("omega", 1)),
        ("thetadd_O", SymbolName("theta", 2, "O")),
        ("wd", SymbolName("w", 1)),
        ("q1", SymbolName("q", 0, "1")),
        ("F_scale", SymbolName("F", 0, "scale")),
        ("mass_matrix", SymbolName("mass_matrix", upright=True)),
        ("motion_I", SymbolName("motion", 0, "I", upright=True)),
        ("d", SymbolName("d")),
    ],
)
def test_names(name: str, shown: SymbolName) -> None:
    assert parse_name(name) == shown


def test_units() -> None:
    assert unit_text("kg*m2") == "kg·m²"
    assert unit_text("m/s2") == "m/s²"
    assert unit_text("") == "–"
