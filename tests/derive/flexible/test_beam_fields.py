"""The beam's integrands against integrals over a real section."""

from __future__ import annotations

import random
from typing import Any

import pytest
import sympy as sp

from mstmm.derive.flexible import beam_fields
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.verification.kernel_evaluation import evaluate

Y, Z = sp.symbols("y z", real=True)
WIDTH, HEIGHT, DENSITY = sp.Rational(3, 10), sp.Rational(1, 5), sp.Rational(7, 2)


def over_rectangle(integrand: sp.Matrix, weight: sp.Expr) -> sp.Matrix:
    """int weight integrand dA over |y| < WIDTH/2, |z| < HEIGHT/2."""
    return sp.Matrix(integrand).applyfunc(
        lambda e: sp.integrate(weight * e, (Y, -WIDTH / 2, WIDTH / 2), (Z, -HEIGHT / 2, HEIGHT / 2))
    )


def outputs(name: str, inputs: dict[str, list[sp.Rational]]) -> dict[str, list[Any]]:
    kernel = lower(beam_fields.KERNELS[name](), name)
    given = {key: [str(v.evalf(60)) for v in row] for key, row in inputs.items()}
    return evaluate(kernel, given)


def draw(seed: int) -> dict[str, list[sp.Rational]]:
    numbers = random.Random(seed)
    sizes = {"axis": 3, "turn": 3, "strain": 6}
    return {
        f"{name}_{k}": [sp.Rational(numbers.randint(-99, 99), 64) for _ in range(size)]
        for k in "kl"
        for name, size in sizes.items()
    } | {"x": [sp.Rational(numbers.randint(1, 99), 32)]}


def section() -> dict[str, list[sp.Expr]]:
    one = sp.Matrix([[1]])
    inertia = [over_rectangle(one * p, DENSITY)[0] for p in (1, Y**2, Z**2)]
    young, shear = sp.Rational(21, 2), sp.Rational(4)
    normal = [over_rectangle(one * p, young)[0] for p in (1, Z**2, Y**2)]
    # Saint-Venant torsion without warping: G I_p, the constant of a section that keeps plane.
    twist = over_rectangle(one * (Y**2 + Z**2), shear)[0]
    shears = [sp.Rational(7, 3), sp.Rational(5, 3)]  # k G A along y and z
    return {"inertia": inertia, "stiffness": [normal[0], twist, normal[1], normal[2], *shears]}


def points(axis: list[sp.Expr], turn: list[sp.Expr]) -> sp.Matrix:
    """Displacement of (y, z): the section moves as a rigid body."""
    a, t = sp.Matrix(axis), sp.Matrix(turn)
    return a + sp.Matrix([t[1] * Z - t[2] * Y, -t[0] * Z, t[0] * Y])


@pytest.mark.parametrize("seed", [1, 2])
def test_integrands_are_those_of_a_rectangular_section(seed: int) -> None:
    drawn = draw(seed)
    found = outputs("moments", drawn | section())
    r0 = sp.Matrix([drawn["x"][0], Y, Z])
    uk, ul = (points(drawn[f"axis_{k}"], drawn[f"turn_{k}"]) for k in "kl")
    for name, integrand in (("C", uk), ("E", r0 * uk.T), ("F", uk * ul.T)):
        exact = over_rectangle(integrand, DENSITY)
        assert [float(v) for v in found[name]] == pytest.approx(
            [float(e) for e in exact], rel=1e-14
        )
    strains = []
    for k in "kl":
        stretch, twist, curved_z, curved_y = drawn[f"strain_{k}"][:4]
        normal = stretch - Z * curved_z - Y * curved_y
        strains.append((normal, -Z * twist, Y * twist))
    energy = sp.Rational(21, 2) * strains[0][0] * strains[1][0]
    energy += 4 * (strains[0][1] * strains[1][1] + strains[0][2] * strains[1][2])
    exact = over_rectangle(sp.Matrix([[energy]]), sp.Integer(1))[0]
    for axis, stiffness in enumerate(section()["stiffness"][4:], 4):
        exact += stiffness * drawn["strain_k"][axis] * drawn["strain_l"][axis]
    assert float(found["K"][0]) == pytest.approx(float(exact), rel=1e-14)


def test_rigid_integrands_are_those_of_a_rectangular_section() -> None:
    x = sp.Rational(13, 8)
    found = outputs("rigid", {"x": [x], "inertia": section()["inertia"]})
    r0 = sp.Matrix([x, Y, Z])
    upper = [over_rectangle(r0 * r0.T, DENSITY)[i, j] for i in range(3) for j in range(i, 3)]
    assert [float(v) for v in found["second"]] == pytest.approx([float(e) for e in upper])
    assert float(found["mass"][0]) == pytest.approx(float(DENSITY * WIDTH * HEIGHT))


def test_a_section_turns_with_the_rotations_of_both_planes() -> None:
    found = outputs("section", {"values": [sp.Integer(v) for v in (1, 2, 3, 4)],
                                "slopes": [sp.Integer(5), sp.Integer(6)]})  # fmt: skip
    assert [float(v) for v in found["phi"]] == [1, 2, 3]
    assert [float(v) for v in found["theta"]] == [4, -6, 5]
