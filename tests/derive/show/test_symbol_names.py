"""Pages speak in the names of an element's author, and their LaTeX compiles within the page."""

from __future__ import annotations

import re
import shutil

import pytest
import sympy as sp

from mstmm.derive import ForceElement, Param
from mstmm.derive.definition.element import Symbols
from mstmm.derive.definition.notation import explicit
from mstmm.derive.elements.body_rigid import RigidBody
from mstmm.derive.equations.rigid_body import newton_euler_form
from mstmm.derive.equations.user_elements import bias_load, inertia
from mstmm.derive.show.captions import split_caption
from mstmm.derive.show.document import ElementView
from mstmm.derive.show.plain_text import text_box
from mstmm.derive.show.show_page import show_view
from mstmm.derive.show.subjects import element_view, view_of_element
from mstmm.derive.show.symbol_names import declared_names
from mstmm.derive.verification.definition_checks import check_element
from tests.support.latex import problems


class Stop(ForceElement):
    """A stop with friction, in names that need care in every format."""

    name = "stop_100"
    title = "stop & brake of 100 % #1"
    parameters = (
        Param("stiffness_of_the_left_side", "N/m", "slope behind the gap"),
        Param("gap", "m", "way that is free"),
        Param("t", "m/s", "a name that an array has"),
        Param("drag", "N", "largest resistance"),
    )

    def potential(self, x: sp.Matrix, p: Symbols) -> sp.Expr:
        return p.stiffness_of_the_left_side * sp.Max(x[0] - p.gap, 0) ** 2 / 2

    def wrench(self, x, v, rotation, w, p, effort, t):  # type: ignore[no-untyped-def]
        slow = sp.Piecewise((v[1] / p.t, sp.Abs(v[1]) < p.t), (sp.sign(v[1]), True))
        return sp.Matrix([0, -p.drag * slow, sp.Min(effort, p.drag)]), sp.zeros(3, 1)


SHOWN = ("force_spring", "hinge_screw", "body_rigid")


@pytest.mark.parametrize("at", ["equations", "matrix", "ir"])
@pytest.mark.parametrize("name", SHOWN)
def test_no_entry_goes_by_a_number(name: str, at: str) -> None:
    """Behind the table of quantities, which tells where names stand for code's p[0]."""
    text = show_view(element_view(name), at)
    said = [line for line in text.splitlines() if not re.match(r"  +\S+ +\w+\[\d", line)]
    assert not re.search(r"\b(p|q|u|motion|motion_I|d_p)\[\d", "\n".join(said))
    assert all(
        parameter.name in text for parameter in element_view(name).declared.parts_by_array["p"]
    )


def test_the_table_tells_what_stands_where() -> None:
    for at in ("equations", "ir", "c"):
        text = show_view(element_view("force_spring"), at)
        assert re.search(r"stiffness +p\[0\] +1 +N/m +spring stiffness\n", text)
        assert re.search(r"damping +p\[2\] +1 +N·s/m ", text)


def test_names_that_arrays_have_stay_apart() -> None:
    text = show_view(view_of_element(Stop()), "equations")
    assert re.search(r"p_t +p\[2\] +1 +m/s +a name that an array has", text)
    assert "stiffness_of_the_left_side" in text and "max(" in text and "sign(" in text
    assert re.search(r"\bp_t\b", text.partition("force, F axes")[2])


def test_functions_that_switch_pass_the_audit() -> None:
    check_element(Stop())


def test_names_of_code_are_those_of_equations() -> None:
    names = declared_names((), (), Stop.parameters)
    assert names.code_entries("p", 4)[:2] == ("p.stiffness_of_the_left_side", "p.gap")
    assert names.code_entries("motion_I", 9)[3] == "wd_I[0]"
    assert names.code_entries("p", 5) == () and names.code_entries("x", 3) == ()


# --- sentences ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("said", "text"),
    [
        ("S_Q = S - U G", "S_Q = S − U G"),
        ("g = D^-1 (tau - H^T e)", "g = D⁻¹ (τ − Hᵀ e)"),
        ("carrier's K = wd~ + w~ w~", "carrier's K = ẇ̃ + w̃ w̃"),
        ("S and e carried across a hinge", "S and e carried across a hinge"),
        ("rotation, P axes to Q axes", "rotation, P axes to Q axes"),
        ("w x (w x r_C) sqrt(m)", "w × (w × r_C) sqrt(m)"),
        ("mass_matrix of the moment-rotation block", "mass_matrix of the moment-rotation block"),
        ("f = S a + e of everything", "f = S a + e of everything"),
        ("relative acceleration at udot = 0", "relative acceleration at u̇ = 0"),
    ],
)
def test_formulas_in_sentences(said: str, text: str) -> None:
    parts = list(split_caption(said))
    shown = "".join(p if isinstance(p, str) else text_box(p).lines[0] for p in parts)
    assert shown == text
    assert any(not isinstance(p, str) for p in parts) or "mass_matrix" in said


# --- the rigid body -----------------------------------------------------------------------------


def test_the_rigid_body_is_what_newton_and_euler_give() -> None:
    """The mass matrix that follows from the integrals is that of the kernel, and so is the load."""
    derived, p = newton_euler_form(), sp.MatrixSymbol("p", 10, 1)
    mass, center = p[0, 0], sp.Matrix([p[k, 0] / p[0, 0] for k in (1, 2, 3)])
    tensor = sp.Matrix(3, 3, lambda i, j: p[4 + (0, 1, 2, 1, 3, 4, 2, 4, 5)[3 * i + j], 0])
    known = {
        sp.MatrixSymbol("M", 1, 1): sp.Matrix([[mass]]),
        sp.MatrixSymbol("r_IC", 3, 1): center,
        sp.MatrixSymbol("J_I", 3, 3): tensor,
    }
    values = {s[i, j]: m[i, j] for s, m in known.items()
              for i in range(m.rows) for j in range(m.cols)}  # fmt: skip
    found = explicit(derived.definition("mass_matrix")).xreplace(values)
    assert (found - explicit(inertia(RigidBody()).definition("S"))).applyfunc(sp.simplify) == (
        sp.zeros(6, 6)
    )
    motion, spin = sp.MatrixSymbol("motion", 9, 1), sp.MatrixSymbol("omega", 3, 1)
    values |= {spin[k, 0]: motion[k, 0] for k in range(3)}
    accelerations = sp.Matrix([motion[k, 0] for k in (6, 7, 8, 3, 4, 5)])
    load = found * accelerations + explicit(derived.definition("bias")).xreplace(values)
    kernel = explicit(bias_load(RigidBody()).definition("e"))
    assert (load - kernel).applyfunc(sp.expand) == sp.zeros(6, 1)


def test_the_rigid_body_begins_at_newton_and_ends_at_the_matrix() -> None:
    text = show_view(element_view("body_rigid"))
    order = [text.index(said) for said in (
        "M (r̈_I + ω̃² r_IC − r̃_IC ω̇) = q_I",
        "M r̃_IC r̈_I + J_I ω̇ + ω̃ J_I ω = m_I",
        "mass_matrix = ⎡ M I     −M r̃_IC ⎤",
        "bias = ⎡ M ω̃² r_IC ⎤",
        "S = ⎡ mass I  S⟨12⟩ ⎤",
    )]  # fmt: skip
    assert order == sorted(order)


# --- LaTeX --------------------------------------------------------------------------------------


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_latex_compiles_within_the_text_width() -> None:
    """Everything that can be shown is compiled by .ci/latex.sh; here what shows most kinds."""
    shown: list[tuple[ElementView, str]] = [
        *((view_of_element(Stop()), at) for at in ("equations", "ir", "c")),
        *((element_view(name), "equations") for name in ("body_rigid", "hinge_pin", "sweep_loops")),
        *((element_view("classical_body_planar"), at) for at in ("matrix", "c")),
    ]
    assert problems((each.name, show_view(each, at, "latex")) for each, at in shown) == []
    for wrong in ("$\\left(x$", "x" * 200 + "\n"):
        assert problems([("wrong", wrong)])[0].startswith("wrong: ")
