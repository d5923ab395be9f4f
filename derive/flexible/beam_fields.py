"""Beam: integrands per length from displacement field and energies.

A point at (y, z) of the section at x has the displacement

    u = (s, v, w) + theta x (0, y, z),    theta = (psi, -psi_w, psi_v)

with displacements s, v, w of the axis, twist psi, and rotations psi_v, psi_w of the section in the
planes of v and w: v' and w' without shear (Euler-Bernoulli), own fields with it (Timoshenko).  The
rotation of the section enters the inertia as `turn`: theta itself with rotary inertia; without it
only the twist, and the rotation of the section with the floating frame.  Strains are the axial one,
s' - y psi_v' - z psi_w', shear v' - psi_v and w' - psi_w, and the rate of twist psi'.  Second-order
displacements and rotations are in `beam_foreshortening`.

The field is linear in the modal coordinates, so that every integral of the mass matrix is bilinear
in two shapes k and l (Shabana, Dynamics of Multibody Systems, ch. 5).  The integrals over the
section are evaluated here; those along the beam are left to a quadrature.
"""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, vector
from ..definition.notation import Matrix

_Y, _Z, _X = sp.symbols("y z x", real=True)

POSITION = Quantity(vector("x", 1), "m", "position along the beam")
INERTIA = Quantity(
    vector("inertia", 3), "", "mass per length (kg/m), int rho y^2 dA, int rho z^2 dA (kg m)"
)
STIFFNESS = Quantity(
    vector("stiffness", 6),
    "",
    "EA (N), GI_t, EI_y, EI_z (N m^2), k GA_y, k GA_z (N); EI_y bends along z, GA_y shears along y",
)
SOURCES = ("Shabana, Dynamics of Multibody Systems, ch. 5",)


def _shape_quantities(k: str) -> tuple[Quantity, ...]:
    """Values of shape k at x, per unit of its modal coordinate."""
    return (
        Quantity(vector(f"axis_{k}", 3), "", f"displacement s, v, w of the axis by shape {k}"),
        Quantity(vector(f"turn_{k}", 3), "", "rotation of the section that carries inertia"),
        Quantity(vector(f"strain_{k}", 6), "", "s', psi', psi_w', psi_v', v' - psi_v, w' - psi_w"),
    )


SHAPE_K, SHAPE_L = _shape_quantities("k"), _shape_quantities("l")


def column_entries(quantity: Quantity) -> Matrix:
    """Entries of a column, one symbol each."""
    return Matrix([quantity.symbol[i, 0] for i in range(quantity.rows)])


def _integrate_section(entry: sp.Expr, weights: Mapping[tuple[int, int], sp.Expr]) -> sp.Expr:
    """int entry dA by the moments of the section about its centre and principal axes."""
    terms = sp.Poly(entry, _Y, _Z).terms()
    return sp.Add(*(c * weights.get(powers, sp.Integer(0)) for powers, c in terms))


def integrate_mass(matrix: Matrix) -> Matrix:
    """int rho matrix dA: principal axes through the mass centre, so that odd moments vanish."""
    m, yy, zz = column_entries(INERTIA)
    return matrix.applyfunc(lambda e: _integrate_section(e, {(0, 0): m, (2, 0): yy, (0, 2): zz}))


def undeformed_position() -> Matrix:
    """Undeformed position r0 of a point, from the root."""
    return Matrix([POSITION.symbol[0, 0], _Y, _Z])


def section_displacement(axis: Matrix, turn: Matrix) -> Matrix:
    """u at (y, z) of the section: displacement of the axis and rotation about it."""
    return Matrix(axis) + Matrix(turn).cross(Matrix([0, _Y, _Z]))


def _shape_displacement(shape: tuple[Quantity, ...]) -> Matrix:
    return section_displacement(column_entries(shape[0]), column_entries(shape[1]))


def _axial_strain() -> tuple[sp.Expr, tuple[sp.Expr, ...]]:
    """(axial strain at (y, z), its derivatives s', psi_w', psi_v'), from the displacement."""
    names = ("s", "v", "w", "psi", "psi_v", "psi_w")
    s, v, w, psi, psi_v, psi_w = (sp.Function(name)(_X) for name in names)
    displacement_field = section_displacement(Matrix([s, v, w]), Matrix([psi, -psi_w, psi_v]))
    return displacement_field[0].diff(_X), (s.diff(_X), psi_w.diff(_X), psi_v.diff(_X))


def strain_energy(strains: Matrix) -> sp.Expr:
    """Strain energy per length (J/m) of s', psi', psi_w', psi_v' and of shear along y and z."""
    axial, derivatives = _axial_strain()
    stretch, twist, curved_z, curved_y, sheared_y, sheared_z = strains
    axial = axial.subs(dict(zip(derivatives, (stretch, curved_z, curved_y), strict=True)))
    ea, git, eiy, eiz, gay, gaz = column_entries(STIFFNESS)
    # E y^2 over the section is EI about z.
    normal = _integrate_section(sp.expand(axial**2), {(0, 0): ea, (2, 0): eiz, (0, 2): eiy})
    return (normal + git * twist**2 + gay * sheared_y**2 + gaz * sheared_z**2) / 2


def _stiffness_integrand() -> sp.Expr:
    """Strain energy of eta_k shape_k + eta_l shape_l, its second derivative by eta_k, eta_l."""
    eta_k, eta_l = sp.symbols("eta_k eta_l")
    strains = eta_k * column_entries(SHAPE_K[2]) + eta_l * column_entries(SHAPE_L[2])
    return sp.expand(sp.diff(strain_energy(strains), eta_k, eta_l))


def rigid_integrands() -> Derivation:
    """Integrands of the mass, of int r0 and of int r0 r0^T."""
    r = undeformed_position()
    mass, first_moment = sp.MatrixSymbol("mass", 1, 1), vector("first", 3)
    second_moment = sp.MatrixSymbol("second", 3, 3)
    return Derivation(
        "beam",
        "integrands per length of the rigid beam's mass, first and second moments",
        (POSITION, INERTIA),
        (
            Quantity(mass, "kg/m", "mass"),
            Quantity(first_moment, "kg", "int rho r0 dA"),
            Quantity(second_moment, "kg m", "int rho r0 r0^T dA", symmetric=True),
        ),
        (
            Equation("mass", mass, integrate_mass(Matrix([[1]]))),
            Equation("first moment", first_moment, integrate_mass(r)),
            Equation(
                "second moment", second_moment, integrate_mass(Matrix(r * r.T)), symmetric=True
            ),
        ),
        sources=SOURCES,
        notes=("principal axes of the section through its mass centre",),
    )


def moment_integrands() -> Derivation:
    """Integrands of C, E, F and of the stiffness, for shapes k and l."""
    r, uk, ul = undeformed_position(), _shape_displacement(SHAPE_K), _shape_displacement(SHAPE_L)
    c = vector("C", 3)
    e, f = sp.MatrixSymbol("E", 3, 3), sp.MatrixSymbol("F", 3, 3)
    stiffness = sp.MatrixSymbol("K", 1, 1)
    return Derivation(
        "beam",
        "integrands per length of the moments of two shapes",
        (POSITION, INERTIA, STIFFNESS, *SHAPE_K, *SHAPE_L),
        (
            Quantity(c, "", "int rho u_k dA"),
            Quantity(e, "", "int rho r0 u_k^T dA"),
            Quantity(f, "", "int rho u_k u_l^T dA"),
            Quantity(stiffness, "", "strain energy's second derivative by eta_k, eta_l"),
        ),
        (
            Equation("C", c, integrate_mass(uk)),
            Equation("E", e, integrate_mass(Matrix(r * uk.T))),
            Equation("F", f, integrate_mass(Matrix(uk * ul.T))),
            Equation("K", stiffness, Matrix([[_stiffness_integrand()]])),
        ),
        sources=SOURCES,
        notes=(
            "displacement u = (s, v, w) + theta x (0, y, z), theta = (psi, -psi_w, psi_v)",
            "axial strain s' - y psi_v' - z psi_w'; shear by psi', and v' - psi_v, w' - psi_w",
        ),
    )


def section_rotation() -> Derivation:
    """Displacement and rotation of a section from the values of the shapes at it."""
    values = Quantity(vector("values", 4), "", "s, v, w, psi")
    slopes = Quantity(vector("slopes", 2), "", "psi_v, psi_w: v', w' without shear")
    phi, theta = vector("phi", 3), vector("theta", 3)
    s, v, w, psi = column_entries(values)
    return Derivation(
        "beam",
        "displacement and rotation vector of a section by one shape",
        (values, slopes),
        (Quantity(phi, "", "displacement of the axis"), Quantity(theta, "", "rotation vector")),
        (
            Equation("phi", phi, Matrix([s, v, w])),
            Equation("theta", theta, Matrix([psi, -slopes.symbol[1, 0], slopes.symbol[0, 0]])),
        ),
        sources=SOURCES,
    )


#: Name -> derivation of the kernels of the linear fields.
KERNELS = {"rigid": rigid_integrands, "moments": moment_integrands, "section": section_rotation}
