"""The beam's second-order fields against a rod whose sections are rotation matrices.

R = 1 + A1 + A2 + ..., A1 = theta~ and A2 = theta~ theta~ / 2 + Psi2~, turns by R' = R kappa~, and
the axis runs along r' = R (e_x + eps), the section's normal if eps has no shear.
"""

from __future__ import annotations

import random
from typing import Any

import pytest
import sympy as sp

from mstmm.derive.flexible import beam_foreshortening
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.verification.kernel_evaluation import evaluate

from .test_beam_fields import DENSITY, Y, Z, over_rectangle, section

ETA = {"k": sp.Rational(2, 3), "l": -sp.Rational(5, 4)}
PAIRS = (("k", "k"), ("k", "l"), ("l", "k"), ("l", "l"))


class Drawn:
    """Random values of two shapes at a section, and of what depends on pairs of them."""

    def __init__(self, seed: int) -> None:
        self.numbers = random.Random(seed)
        self.of_shapes: dict[str, dict[str, list[sp.Rational]]] = {}

    def random_rationals(self, count: int) -> list[sp.Rational]:
        return [sp.Rational(self.numbers.randint(-99, 99), 64) for _ in range(count)]

    def shapes(self, name: str, rows: int) -> sp.Matrix:
        """The value of eta_k shape_k + eta_l shape_l."""
        self.of_shapes[name] = {k: self.random_rationals(rows) for k in "kl"}
        return sum(
            (ETA[k] * sp.Matrix(v) for k, v in self.of_shapes[name].items()), sp.zeros(rows, 1)
        )

    def second(self, kernel: str, output: str, **pairs: Any) -> sp.Matrix:
        """-1/2 sum_kl eta_k eta_l output_kl of a kernel; `pairs` are functions of k and l."""
        ir = lower(beam_foreshortening.KERNELS[kernel](), kernel)
        names = {port.name for port in ir.inputs}
        parts = []
        for k, other in PAIRS:
            given = {
                f"{name}_{side}": values[shape]
                for name, values in self.of_shapes.items()
                for side, shape in (("k", k), ("l", other))
            } | {name: make(k, other) for name, make in pairs.items()}
            found = evaluate(
                ir, {n: [str(sp.N(v, 60)) for v in row] for n, row in given.items() if n in names}
            )
            values = [sp.Float(str(v), 50) for v in found[output]]
            parts.append(-sp.Matrix(values) * ETA[k] * ETA[other] / 2)
        return sum(parts[1:], parts[0])


def close(found: sp.Matrix, exact: sp.Matrix) -> None:
    assert [float(v) for v in found] == pytest.approx([float(v) for v in exact], abs=1e-14)


@pytest.mark.parametrize("seed", [1, 2])
def test_sections_turn_by_the_curvature_of_their_shapes(seed: int) -> None:
    drawn = Drawn(seed)
    theta, kappa = drawn.shapes("theta", 3), drawn.shapes("kappa", 3)
    square_rate = (theta.hat() * kappa.hat() + kappa.hat() * theta.hat()) / 2
    close(drawn.second("turning", "dh"), (theta.hat() * kappa.hat() - square_rate).vee())


@pytest.mark.parametrize("seed", [3, 4])
def test_the_axis_has_its_strain_in_the_axes_of_its_sections(seed: int) -> None:
    drawn = Drawn(seed)
    theta, eps = drawn.shapes("theta", 3), drawn.shapes("eps", 3)
    rotation = {pair: drawn.random_rationals(3) for pair in (("k", "k"), ("k", "l"), ("l", "l"))}
    rotation["l", "k"] = rotation["k", "l"]
    turned = sum(
        (-sp.Matrix(rotation[pair]) * ETA[pair[0]] * ETA[pair[1]] / 2 for pair in PAIRS),
        sp.zeros(3, 1),
    )
    second = (theta.hat() * theta.hat() / 2 + turned.hat())[:, 0] + theta.hat() * eps
    close(drawn.second("drawing", "dg", h=lambda *pair: rotation[pair]), second)


@pytest.mark.parametrize("seed", [5, 6])
def test_moments_of_second_order_are_those_of_a_rectangular_section(seed: int) -> None:
    drawn = Drawn(seed)
    turn, x = drawn.shapes("turn", 3), drawn.random_rationals(1)
    g = {pair: drawn.random_rationals(3) for pair in (("k", "k"), ("k", "l"), ("l", "l"))}
    h = {pair: drawn.random_rationals(3) for pair in g}
    for known in (g, h):
        known["l", "k"] = known["k", "l"]
    axis, turned = (
        sum((-sp.Matrix(f[p]) * ETA[p[0]] * ETA[p[1]] / 2 for p in PAIRS), sp.zeros(3, 1))
        for f in (g, h)
    )
    field = axis + (turned.hat() + turn.hat() * turn.hat() / 2) * sp.Matrix([0, Y, Z])
    given = {
        "g": lambda *pair: g[pair],
        "h_turn": lambda *pair: h[pair],
        "x": lambda *pair: x,
        "inertia": lambda *pair: section()["inertia"],
    }
    close(drawn.second("second_moments", "G", **given), over_rectangle(field, DENSITY))
    lever = over_rectangle(sp.Matrix([x[0], Y, Z]) * field.T, DENSITY)
    close(drawn.second("second_moments", "X", **given), sp.Matrix(list(lever)))
