"""Functions that switch branches: what is lawful agrees and runs, what is not is refused by both
`check_element` and `generate`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import mstmm
from mstmm.derive import ForceElement, Hinge, Param, rotation_about
from mstmm.derive.definition.nonsmooth_functions import slope
from mstmm.derive.verification.definition_checks import check_element
from mstmm.errors import ElementError
from mstmm.pipeline.crosscheck import crosscheck_definition

a, r = sp.symbols("q_angle p_r", real=True)
LIFTS = {
    "cubic_dwell": r * sp.Piecewise((a**3, a > 0), (0, True)),
    "parabolic_dwell": r * sp.Max(0, a) ** 2,
    "cubed": r * sp.Abs(a) ** 3,
    "signed": r * sp.sign(a) * a**2,
    "nested": r * sp.Max(0, sp.Min(a, 2 * a), a - 1) ** 2,
    "off_centre": r * sp.Min(0, a - sp.Rational(1, 3)) ** 2,
}
JUMPS = {
    "kink": (r * sp.Abs(a), r"the velocity .* jumps at q.angle = 0.0, where Abs\(q.angle\)"),
    "knee": (r * sp.Max(a, 2 * a), "the velocity .* jumps at q.angle = 0.0, where Max"),
    "stairs": (r * sp.floor(a), r"position\(q, p\) jumps at q.angle = -3.0, where floor"),
    "ramp": (r * sp.Piecewise((a, a > 1), (0, True)), r"position\(q, p\) jumps at q.angle = 1.0"),
    "step": (r * sp.sign(a), r"position\(q, p\) jumps at q.angle = 0.0, where sign"),
}


def cam(title: str, height: sp.Expr) -> Hinge:
    """A pin whose body is lifted along x as it turns."""

    class Cam(Hinge):
        name = title
        coordinates = (Param("angle", "rad"),)
        parameters = (Param("r", "m", minimum=0.01),)

        def rotation(self, q, p):  # type: ignore[no-untyped-def]
            return rotation_about(2, q.angle)

        def position(self, q, p):  # type: ignore[no-untyped-def]
            return sp.Matrix([height.xreplace({a: q.angle, r: p.r}), 0, 0])

    return Cam()


class Floor(ForceElement):
    """Pushes up with a constant stiffness below z = 0."""

    name = "soft_floor"
    parameters = (Param("stiffness", "N/m", minimum=0),)

    def wrench(self, x, v, rotation, w, p, effort, t):  # type: ignore[no-untyped-def]
        return sp.Matrix([0, 0, p.stiffness * sp.Max(0, -x[2])]), sp.zeros(3, 1)

    def potential(self, x, p):  # type: ignore[no-untyped-def]
        return p.stiffness * sp.Max(0, -x[2]) ** 2 / 2


class Broken(Floor):
    """Its energy jumps at z = 0."""

    name = "broken_floor"

    def potential(self, x, p):  # type: ignore[no-untyped-def]
        return p.stiffness * x[2] ** 2 * sp.floor(x[2]) / 2


class Root(ForceElement):
    """Has no value where a width without bounds is below zero."""

    name = "rooted_floor"
    parameters = (Param("stiffness", "N/m", minimum=0), Param("width", "m"))

    def wrench(self, x, v, rotation, w, p, effort, t):  # type: ignore[no-untyped-def]
        return sp.zeros(3, 1), sp.zeros(3, 1)

    def potential(self, x, p):  # type: ignore[no-untyped-def]
        return p.stiffness * sp.sqrt(p.width) ** 3 * sp.sqrt(x.dot(x)) ** sp.Rational(1, 2)


@pytest.mark.parametrize("name", LIFTS)
def test_branches_that_meet_agree(name: str) -> None:
    element = cam(name, LIFTS[name])
    check_element(element)
    assert crosscheck_definition(element, points=1).passed


@pytest.mark.parametrize("name", JUMPS)
def test_an_impulse_is_refused(name: str) -> None:
    height, message = JUMPS[name]
    with pytest.raises(ElementError, match=message):
        check_element(cam(name, height))


def test_forces_may_kink_and_energies_may_not_jump() -> None:
    check_element(Floor())
    assert crosscheck_definition(Floor()).passed
    with pytest.raises(ElementError, match=r"potential\(x, p\) jumps at x_3 = -1.0, where floor"):
        check_element(Broken())


def test_numbers_without_a_value_are_told_by_their_names() -> None:
    with pytest.raises(ElementError, match=r"p\.width.* no finite real value .* minimum=0"):
        crosscheck_definition(Root(), points=1)


@pytest.mark.parametrize("name", LIFTS)
def test_slopes_are_those_of_the_branches(name: str) -> None:
    height = LIFTS[name].xreplace({r: sp.Integer(2)})
    first = slope(height, a)
    for x in (-1.3, -0.2, 0.1, 0.9):
        for value, derivative in ((height, first), (first, slope(first, a))):
            before, after = (float(value.xreplace({a: sp.Float(x + d)})) for d in (-1e-5, 1e-5))
            assert float(derivative.xreplace({a: sp.Float(x)})) == pytest.approx(
                (after - before) / 2e-5, rel=1e-6, abs=1e-6
            )


def test_a_dwell_moves_as_its_equation_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """(m f'^2 + J) a'' + m f' f'' a'^2 + m g f' = 0 for the lift f along -gravity."""
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path))
    mstmm.register(type(cam("cubic_dwell", LIFTS["cubic_dwell"])))
    mass, inertia, g, rise = 2.0, 0.3, 9.81, 0.15
    scene = mstmm.Scene(
        gravity=(-g, 0, 0),
        body=[{"name": "follower", "mass": mass, "inertia": [inertia] * 3}],
        hinge=[{"name": "cam", "type": "cubic_dwell", "inboard": "ground", "outboard": "follower",
                "parameters": {"r": rise}, "initial": {"q": [-1.0], "u": [2.5]}}],
    )  # fmt: skip
    result = mstmm.compile(scene, engine="looped").simulate(2.0, output_times=[0.0, 1.0, 2.0])

    def rate(t: float, y: np.ndarray) -> list[float]:
        x, u = max(y[0], 0.0), y[1]
        f1, f2 = 3 * rise * x**2, 6 * rise * x
        return [u, -mass * f1 * (f2 * u**2 + g) / (mass * f1**2 + inertia)]

    expected = solve_ivp(rate, (0, 2), [-1.0, 2.5], "DOP853", [0, 1, 2], rtol=1e-11, atol=1e-12)
    assert result.success
    assert result.q[:, 0] == pytest.approx(expected.y[0], rel=1e-7)
    assert expected.y[0][1] > 0.3, "it has left the dwell"
