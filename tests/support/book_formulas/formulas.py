"""Formulas of Jing and Stephansson, chapter 2, against the derived ones: misprints, conventions.

Each entry of `PRINTED_FORMULAS` states a formula as the book prints it (in our symbols), what the
derivation of `newton_euler` gives, and a check that computes which of the two the mechanics
supports.  `as_markdown` renders the list for docs/explanation.

Source: L. Jing, O. Stephansson, Fundamentals of Discrete Element Methods for Rock Engineering:
Theory and Applications, Developments in Geotechnical Engineering 85, Elsevier, Amsterdam 2007.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tests.support.book_formulas import checks, elastic


@dataclass(frozen=True)
class PrintedFormula:
    """One printed formula and what became of it.

    `status` is "holds", "misprint" (the printed form is wrong) or "convention" (it holds only when
    read in the way `finding` says).  `check` is true when the computation bears the status out.
    """

    number: str
    subject: str
    status: str
    printed: str
    derived: str
    finding: str
    check: Callable[[], bool]


PRINTED_FORMULAS: tuple[PrintedFormula, ...] = (
    PrintedFormula(
        "(2.9)", "moments and products of inertia", "convention",
        "Ixx = int (y^2 + z^2) dV, Ixy = int x y dV",
        "Ixx = int (y^2 + z^2) dm, Ixy = int x y dm",
        "(2.8) keeps the density outside the integrals; (2.22) mixes Ixx with the mass M, so there "
        "the integrals have to be taken over the mass (a factor rho for a uniform body).",
        checks.mass_integrals,
    ),
    PrintedFormula(
        "(2.10)", "inertia tensor", "misprint",
        "off-diagonal entries +Ixy, +Ixz, +Iyz", "off-diagonal entries -Ixy, -Ixz, -Iyz",
        "With products defined as +int x y dm the printed array does not transform as a tensor; it "
        "also contradicts the characteristic equation (2.12), which has the right signs.",
        checks.tensor_sign,
    ),
    PrintedFormula(
        "(2.18), also (2.4)", "acceleration field, y component", "misprint",
        "... + z (omega_y omega_z - domega_z)", "... + z (omega_y omega_z - domega_x)",
        "The last rate has the wrong index; the x and z components are right.",
        checks.field_misprint,
    ),
    PrintedFormula(
        "(2.20)", "moment of the inertial force of dm", "holds",
        "(a_z y - a_y z, a_x z - a_z x, a_y x - a_x y) dm", "(r x a) dm", "",
        checks.moments_of_element,
    ),
    PrintedFormula(
        "(2.21), (2.29) to (2.33)", "moment of the forces over the volume", "convention",
        "int rho (f_z y - f_y z) dV", "int (f_z y - f_y z) dV with f dV = force on dV",
        "(2.19) and (2.28) let f be the force on dm; under rho dV it has to be the force per unit "
        "mass, else the two sides scale differently with the density.",
        checks.density,
    ),
    PrintedFormula(
        "(2.22)", "Euler's equations, arbitrary origin", "holds",
        "M (a0z yc - a0y zc) + Ixx domega_x + (Izz - Iyy) omega_y omega_z + ... = Tx",
        "M r_c x a0 + J domega + omega x J omega = T",
        "All three lines agree term by term. Products of inertia are +int x y dm, a0 is the "
        "acceleration of the body-fixed origin in body axes, and T is the moment about that "
        "origin.",
        checks.general_form,
    ),
    PrintedFormula(
        "(2.23)", "moment of the applied forces", "convention",
        "Tx = sum (fZ Y - fY Z) in the inertial frame", "T_o = R^T (T_O - X0 x sum f)",
        "The sum is the moment about the inertial origin in inertial axes; (2.22) needs the moment "
        "about the body's origin in body axes. Applied couples have to be added.",
        checks.moment_point,
    ),
    PrintedFormula(
        "(2.24)", "principal axes at o", "holds", "(2.22) without products of inertia",
        "the same", "", checks.principal,
    ),
    PrintedFormula(
        "(2.25)", "origin at the mass centre, or fixed", "holds",
        "(2.22) without the terms in M", "the same",
        "A fixed origin must be a point of the body; then a0 = 0. The inertia is the one about o.",
        checks.special_origin,
    ),
    PrintedFormula(
        "(2.25) (b)", "axes at the mass centre that need not be fixed in the body", "convention",
        "(2.25) unchanged", "one more term J (W x omega), W the angular velocity of the axes",
        "The term vanishes for W parallel to omega: for axes fixed in the body, and for axes that "
        "do not turn (with the inertia evaluated afresh at every instant). For any other axes the "
        "printed form is wrong.",
        checks.axes_not_in_body,
    ),
    PrintedFormula(
        "(2.26)", "principal axes, origin central or fixed", "holds",
        "Ix domega_x + (Iz - Iy) omega_y omega_z = Tx and cyclic", "the same", "",
        checks.reduced_principal,
    ),
    PrintedFormula(
        "(2.27)", "X = X0 + x in parallel frames", "convention",
        "body-embedded axes parallel to the inertial ones",
        "axes that move with o and do not turn (x, y, z of a body point vary)",
        "Axes fixed in a turning body do not stay parallel: dr/dt = omega x r. Everything up to "
        "(2.36) holds for axes that keep their direction.",
        checks.parallel_axes,
    ),
    PrintedFormula(
        "(2.28), second line", "acceleration of dm", "misprint",
        "d2X/dt2 = d2x/dt2", "d2X/dt2 = d2X0/dt2 + d2x/dt2",
        "The lower-case x drops the acceleration of the origin, which (2.31) then uses.",
        checks.element_acceleration,
    ),
    PrintedFormula(
        "(2.29), (2.30)", "rate of angular momentum about the inertial origin", "holds",
        "int X x A dm = d/dt int X x V dm", "the same", "", checks.momentum_rate,
    ),
    PrintedFormula(
        "(2.31)", "split of the moment, second line", "misprint",
        "int (ddx z' - ddz x) dm", "int (ddx z - ddz x) dm",
        "A prime too many on z in the middle integral; the other lines and terms are right.",
        checks.split_moment,
    ),
    PrintedFormula(
        "(2.32a)", "first moments", "holds",
        "int ddZ0 y dm = M ddZ0 yc and the like", "the same", "",
        checks.first_moments,
    ),
    PrintedFormula(
        "(2.32b)", "split of the applied moment", "holds",
        "T_X = int [fz (Y0 + y) - fy (Z0 + z)]", "X0 x sum f + moment about o", "",
        checks.moment_about_origin,
    ),
    PrintedFormula(
        "(2.33), (2.35)", "moment about o by relative angular momentum", "holds",
        "T = M r_c x ddX0 + dh/dt", "the same, dh/dt the inertial rate",
        "Agrees with (2.22) identically once dh/dt is the inertial rate: in body axes the rate of "
        "the components of h plus omega x h.",
        checks.relative_form,
    ),
    PrintedFormula(
        "(2.34), text after (2.35)", "h evaluated in the body-embedded frame", "convention",
        "dh_x/dt = int (ddz y - ddy z) dm in the body frame", "dh/dt = J domega + omega x J omega",
        "In body axes x, y, z are constants, so the printed integrals vanish; and the rate of the "
        "components of h = J omega in body axes alone lacks omega x h.",
        checks.missing_gyroscopic_term,
    ),
    PrintedFormula(
        "text after (2.35)", "no inertia or angular velocity needed", "convention",
        "T = M r_c x ddX0 + dh/dt needs neither", "h = J omega",
        "True only if the positions of all mass elements are themselves integrated in axes that do "
        "not turn; for a rigid body h holds the angular velocity and the second moments.",
        checks.needs_angular_velocity,
    ),
    PrintedFormula(
        "(2.36)", "central or fixed origin", "holds", "T = dh/dt", "the same",
        "With the inertial rate of h, and a fixed origin being a point of the body.",
        checks.reduced_momentum,
    ),
    PrintedFormula(
        "(2.22) against (2.27) to (2.36)", "both forms", "holds",
        "two derivations of the same moment", "equal identically",
        "Neither contains the position or the velocity of the origin.",
        lambda: checks.relative_form() and checks.no_velocity_of_origin(),
    ),
    PrintedFormula(
        "(2.81), (2.82), second row", "elastic equations in partitioned form", "misprint",
        "M_fr ddu_r + M_rf ddu_f + K_ff u_f = F_f", "M_fr ddu_r + M_ff ddu_f + K_ff u_f = F_f",
        "M_rf has a row per rigid coordinate and does not fit; the text below it names M_ff as the "
        "mass matrix of the deformation.",
        elastic.modal_rows,
    ),
    PrintedFormula(
        "(2.84), (2.85)", "shape functions of the rectangle", "convention",
        "b and c are its length and width", "b and c are half its length and width",
        "The figure shows edges 2b and 2c; only then is each function 1 at its own node and 0 at "
        "the others.",
        elastic.half_edges,
    ),
    PrintedFormula(
        "(2.86), (2.87)", "rectangle in a finite rotation", "convention",
        "S U^T = R + A x", "S U = R + A x",
        "U is a column. The element moves as a rigid body without strain, because its shape "
        "functions sum up to one and reproduce its coordinates.",
        elastic.finite_rotation,
    ),
)  # fmt: skip


_PREFACE = """# Errata and conventions of the source texts

After this page you know which printed formulas of the sources are correct, and how to read them.

The source is L. Jing, O. Stephansson, *Fundamentals of Discrete Element Methods for Rock
Engineering*, Elsevier 2007, chapter 2, in an electronic text of the book. `omega` is the angular
velocity, `domega` its rate in body axes, and `a0` the acceleration of the body's origin `X0`. `r_c`
is the mass centre, `J` the inertia tensor about the origin, and `ddX` a second derivative.

*Holds* means that the derived form agrees identically, *convention* that it agrees with the reading
in the remark, *misprint* that it does not agree. Every verdict is computed by
`tests/support/book_formulas/checks.py` or `tests/support/book_formulas/elastic.py`. This page is
written from `tests/support/book_formulas/formulas.py`, and the tests repeat the checks.

"""


def as_page() -> str:
    """The page docs/explanation/errata.md."""
    return _PREFACE + as_markdown()


def as_markdown() -> str:
    """The list as a Markdown table, in the book's order."""
    head = ("equation", "subject", "verdict", "printed", "derived", "remark")
    rows = [
        (f.number, f.subject, f.status, _code(f.printed), _code(f.derived), f.finding)
        for f in PRINTED_FORMULAS
    ]
    lines = [" | ".join(row) for row in (head, ("---",) * len(head), *rows)]
    return "".join(f"| {line} |\n" for line in lines)


def _code(text: str) -> str:
    return f"`{text}`" if any(sign in text for sign in "=+^") else text
