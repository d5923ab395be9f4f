"""Frequencies and stability limits, from derivatives of the accelerations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.reference.compare import worst
from tests.reference.flexible import closed_forms
from tests.reference.flexible import finite_elements as fe
from tests.support.models import looped_model
from tests.support.scenes.flexible import (
    Array,
    beam,
    frequencies,
    hinge,
    motion_near,
    scene,
    turning_beam,
)

L_FRAME = fe.l_frame(0.6, 0.5, 50.0, 3)


@pytest.mark.parametrize(
    ("basis", "n", "tolerance"),
    [
        # Shapes without end moment or end deflection converge like 1/n.
        ("clamped-free", 4, [0.09, 0.04, 0.07]),
        ("clamped-free", 8, [0.045, 0.02, 0.032]),
        ("static+fixed-interface", 2, [3e-3, 0.17, 0.31]),
        ("static+fixed-interface", 4, [3e-5, 1e-4, 7e-4]),
    ],
)
def test_l_frame(basis: str, n: int, tolerance: list[float]) -> None:
    bent = {"orientation": [0.0, 0.0, np.pi / 2]}
    data = scene(
        beam("first", 0.6, 50.0, modes={"y": n}, basis=basis),
        beam("second", 0.5, 50.0, modes={"y": n}, basis=basis),
        hinge("pin", "pin", "ground", "first"),
        hinge("corner", "fixed", "first.tip", "second", **bent),
    )
    errors = frequencies(*motion_near(data), 3) / L_FRAME - 1
    assert (errors > -1e-6).all()  # a Ritz method is never too soft
    assert (errors < tolerance).all()
    if basis == "clamped-free":
        assert (errors > 0.25 * np.array(tolerance)).all()  # such shapes stay this far off


@pytest.mark.parametrize("lag", (False, True), ids=("flap", "lag"))
@pytest.mark.parametrize(
    ("hub", "spin", "tolerance"),
    [(0, 1, 1e-6), (0, 3, 1e-5), (0, 12, 1.5e-3), (1, 2, 1e-5), (1, 10, 2e-3), (5, 10, 8e-3)],
)
def test_turning_beam(lag: bool, hub: float, spin: float, tolerance: float) -> None:
    data = turning_beam(spin, hub, modes={"y" if lag else "z": 6})
    found = frequencies(*motion_near(data), 2)
    assert worst(found, fe.rotating(hub, spin, lag, 2)) < tolerance


@pytest.mark.parametrize("word", ("y", "z"))
def test_exact_derivatives_give_the_same_matrices(word: str) -> None:
    data = turning_beam(3.0, 0.5, modes={word: 3})
    for exact, differences in zip(motion_near(data, exact=True), motion_near(data), strict=True):
        assert worst(exact, differences, floor=1.0) < 1e-8


@pytest.mark.parametrize("lag", (False, True), ids=("flap", "lag"))
def test_turning_beam_with_many_shapes(lag: bool) -> None:
    data = turning_beam(12.0, 0.0, modes={"y" if lag else "z": 12})
    assert worst(frequencies(*motion_near(data), 1), fe.rotating(0, 12, lag, 1)) < 2e-4


def test_linear_beam_diverges_at_its_first_frequency() -> None:
    """Without stiffening the square of the lag frequency is 12.362 - spin^2."""
    for spin, sign in ((3.4, 1.0), (3.6, -1.0)):
        by_q, _ = motion_near(turning_beam(spin, modes={"y": 1}, stiffening=False))
        assert abs(-by_q[0, 0] - (fe.rotating(0, 0, True, 1)[0] ** 2 - spin**2)) < 1e-5
        assert np.sign(-by_q[0, 0]) == sign


@pytest.mark.parametrize(("stiffness", "tolerance"), [(1.0, 3e-6), (0.05, 3e-6)])
def test_hanging_beam(stiffness: float, tolerance: float) -> None:
    hang: dict[str, Any] = {"gravity": (9.81, 0.0, 0.0)}
    pin = hinge("pin", "pin", "ground", "rope")
    data = scene(beam("rope", 1.0, stiffness, modes={"y": 8}), pin, **hang)
    exact = fe.hanging(stiffness, 9.81, 3)
    assert worst(frequencies(*motion_near(data), 3), exact) < tolerance
    linear = scene(beam("rope", 1.0, stiffness, modes={"y": 4}, stiffening=False), pin, **hang)
    by_q, by_u = motion_near(linear)
    if stiffness == 1.0:
        errors = frequencies(by_q, by_u, 3) / exact - 1
        assert worst(errors, [-0.33, -0.75, -0.18]) < 0.02
    else:
        assert np.linalg.eigvals(by_q).real.max() > 0  # unstable


def test_heavy_chain() -> None:
    """EI to zero: 1.2024 sqrt(g/L)."""
    pin = hinge("pin", "pin", "ground", "rope")
    data = scene(beam("rope", 1.0, 1e-4, modes={"y": 10}), pin, gravity=(9.81, 0.0, 0.0))
    chain = closed_forms.HEAVY_CHAIN * np.sqrt(9.81)
    found = frequencies(*motion_near(data), 1)[0]
    assert abs(found / chain - 1) < 2e-4
    assert abs(found / fe.hanging(1e-4, 9.81, 1)[0] - 1) < 1e-4


def linear_in(data_of: Any) -> tuple[Array, Array]:
    """A_q = A_0 + p A_1 of a scene that has p times a load, at rest."""
    none, one = (motion_near(data_of(p))[0] for p in (0.0, 1.0))
    return none, one - none


@pytest.mark.parametrize(("n", "load"), [(2, 7.853), (4, 7.8382), (6, 7.8375)])
def test_self_weight_buckling(n: int, load: float) -> None:
    clamp = hinge("clamp", "fixed", "ground", "mast")
    still, weight = linear_in(
        lambda g: scene(beam("mast", modes={"y": n}), clamp, gravity=(-g, 0.0, 0.0))
    )
    found = 1 / np.linalg.eigvals(-np.linalg.solve(still, weight)).real.max()
    assert abs(found - load) < 6e-5 * load
    assert -1e-9 < found - closed_forms.SELF_WEIGHT_BUCKLING < 2e-2


def flutter(still: Array, pushed: Array, low: float, high: float) -> float:
    """Load at which two frequencies of still + p pushed meet."""

    def unstable(p: float) -> bool:
        return bool(np.abs(np.linalg.eigvals(still + p * pushed).imag).max() > 1e-3 * p)

    assert not unstable(low)
    assert unstable(high)
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (low, middle) if unstable(middle) else (middle, high)
    return low


@pytest.mark.parametrize(("n", "load"), [(4, 20.0526), (6, 20.0498), (8, 20.0502)])
def test_beck_column(n: int, load: float) -> None:
    """A force at the tip that follows its section: flutter at 20.05 EI/L^2 (Beck 1952)."""
    clamp = hinge("clamp", "fixed", "ground", "column")

    def column(p: float) -> Any:
        push = {"on": "column.tip", "force": [-p, 0.0, 0.0], "axes": "body"}
        return scene(beam("column", modes={"y": n}), clamp, load=[push])

    found = flutter(*linear_in(column), 15.0, 25.0)
    assert abs(found - load) < 2e-4
    assert abs(found / fe.beck() - 1) < 2e-4


def test_free_beam_under_thrust() -> None:
    """A force that pushes a free beam at its end and follows it."""
    free = hinge("flight", "planar", "ground", "rocket", axis=[0, 0, 1], axis2=[1, 0, 0])

    def rocket(p: float) -> Any:
        push = {"on": "rocket.root", "force": [p, 0.0, 0.0], "axes": "body"}
        body = beam("rocket", modes={"y": 8}, frame="mean", basis="free-free")
        return scene(body, free, load=[push])

    assert abs(flutter(*linear_in(rocket), 80.0, 125.0) / fe.thrust(30) - 1) < 1e-3


@pytest.mark.parametrize("spin", (1.0, 4.0, 5.5))
def test_shaft_spinning_about_its_own_axis(spin: float) -> None:
    """Each pair of shapes as the closed form says; unstable between unequal bending frequencies."""
    about_y, about_z = 1.2, 2.1  # EI; frequencies 3.5160 sqrt(EI)
    data = scene(
        beam("shaft", 1.0, [about_y, about_z], modes=2, polar_inertia_per_length=0.01),
        hinge("bearing", "pin", "ground", "shaft", axis=[1, 0, 0], drive=f"{spin!r}*t"),
    )
    by_q, by_u = motion_near(data)
    n = len(by_q)
    roots = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [by_q, by_u]]))
    at_rest = fe.rotating(0, 0, False, 2)
    exact = np.concatenate(
        [
            closed_forms.spinning_shaft(w * np.sqrt(about_y), w * np.sqrt(about_z), spin)
            for w in at_rest
        ]
    )
    squares = np.sort(-(roots**2).real)
    assert worst(squares, np.repeat(np.sort(exact), 2)) < 1e-6
    first = at_rest[0] * np.sqrt([about_y, about_z])
    assert (roots.real.max() > 1e-3) == (first[0] < spin < first[1])


def test_equal_stiffness_shows_the_frequencies_less_and_plus_the_spin() -> None:
    data = scene(
        beam("shaft", modes=1, polar_inertia_per_length=0.01),
        hinge("bearing", "pin", "ground", "shaft", axis=[1, 0, 0], drive="2*t"),
    )
    still = fe.rotating(0, 0, False, 1)[0]
    assert worst(frequencies(*motion_near(data), 2), [still - 2, still + 2]) < 1e-7


def test_steady_stretch_of_a_turning_beam() -> None:
    """rho A W^2 L^3 / (3 EA) = 5.143e-4 for the data of Simo and Vu-Quoc's beam."""
    mass, length, stiffness, spin = 1.2, 10.0, 2.8e7, 6.0
    own = {
        "mass_per_length": mass,
        "axial_stiffness": stiffness,
        "basis": "auto",
        "shapes": {"axial": ["x/L", "(x/L)^3"], "y": ["(x/L)^2"]},
        "polar_inertia_per_length": 1e-3,
    }
    data = scene(
        beam("blade", length, 1.4e4, **own),
        hinge("drive", "pin", "ground", "blade", drive=f"{spin!r}*t"),
    )
    model = looped_model(data)
    q, u = model.initial_state()
    by_q, _ = motion_near(data)
    for _ in range(3):  # Newton's steps to a steady deflection
        q[1:] -= np.linalg.solve(by_q, model.accelerations(q, u)[1:])
    expected = closed_forms.steady_stretch(mass, spin, length, stiffness)
    assert abs(expected - 5.143e-4) < 1e-7
    # The stretched beam is longer and pulls more, by some W^2 L^2 rho/E.
    assert abs(q[2] + q[3] - expected) < 2e-4 * expected
    assert abs(q[1]) < 1e-15
