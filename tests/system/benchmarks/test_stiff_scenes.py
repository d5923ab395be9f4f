"""The benchmark's scenes and stored places against derivations that share nothing with them."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import sympy as sp

import mstmm
from benchmarks.stiff import references, scenes
from benchmarks.stiff.absolute_coordinates import BushedRods
from benchmarks.stiff.cases import CASES
from tests.support.implicit_methods.lagrange import accelerations, energy, rate, rotated_vector
from tests.support.implicit_methods.quarter_car import quarter_car_at

Array = npt.NDArray[np.float64]
GRAVITY = 9.81


def symbols(count: int) -> tuple[list[Any], list[Any], Any]:
    """Coordinates, speeds and time."""
    return list(sp.symbols(f"q:{count}")), list(sp.symbols(f"u:{count}")), sp.Symbol("t")


def random_values(rng: np.random.Generator, sizes: Any) -> Array:
    return np.asarray(rng.uniform(-1, 1, len(sizes)) * sizes)


def test_two_rods_on_bushings_follow_lagrange(rng: np.random.Generator) -> None:
    k, zeta = 1e4, 0.1
    q, u, t = symbols(6)
    first, second = (
        rotated_vector(0, q[0], q[1]),
        rotated_vector(0, q[0], q[1]) + rotated_vector(q[2], 1 + q[3], q[4]),
    )
    centers = (first + rotated_vector(q[2], 0.5, 0), second + rotated_vector(q[2] + q[5], 0.5, 0))
    T = energy(1, 1 / 12, centers[0], q[2], q, u) + energy(1, 1 / 12, centers[1], q[2] + q[5], q, u)
    V = GRAVITY * (centers[0][1] + centers[1][1]) + k * sum(q[i] ** 2 for i in (0, 1, 3, 4)) / 2
    F = 2 * zeta * np.sqrt(k) * sum(u[i] ** 2 for i in (0, 1, 3, 4)) / 2
    udot = accelerations(q, u, T, V, F, t)
    model = mstmm.compile(mstmm.Scene(**scenes.bushed_rods(2, k, zeta)), engine="looped")
    for _ in range(3):
        at, rates = (
            random_values(rng, [0.01, 0.01, 1, 0.01, 0.01, 1]),
            random_values(rng, [1, 1, 3, 1, 1, 3]),
        )
        expected = udot(0.0, at, rates)
        scale = np.abs(expected).max()
        assert model.accelerations(at, rates) == pytest.approx(expected, abs=1e-11 * scale)


def test_half_car_follows_lagrange(rng: np.random.Generator) -> None:
    k, zeta = 1e7, 0.01
    q, u, t = symbols(8)
    y, pitch = q[:2]
    car, mass_center = scenes.CAR, sp.Matrix([0, y])
    mass, center, hub, inertia = car["arm"]
    turning, turning_damping, weight = car["spring"]
    tyre, tyre_damping, height, slack = car["tyre"]
    T = energy(car["mass"], car["inertia"], mass_center, pitch, q, u)
    V, F = car["mass"] * GRAVITY * y, sp.Integer(0)
    for i, (x, yaw, delay) in enumerate(scenes.WHEELS.values()):
        sign = 1 if yaw == 0 else -1
        a, b, angle = q[2 + 3 * i : 5 + 3 * i]
        root = mass_center + rotated_vector(pitch, x + sign * a, sign * b)
        arm = mass_center * 0 + rotated_vector(pitch + angle, sign, 0)
        T += energy(mass, inertia, root + center * arm, pitch + angle, q, u)
        tip = root + hub * arm
        length = sp.sqrt((tip[0] - x - sign * hub) ** 2 + (tip[1] + height) ** 2)
        road = 0.02 * (1 - sp.cos(3 * sp.pi * (t - delay)))
        road += 0.001 * (1 - sp.cos(24 * sp.pi * (t - delay)))
        V += mass * GRAVITY * (root + center * arm)[1] + k * (a**2 + b**2) / 2
        V += turning * (angle + sign * weight) ** 2 / 2
        V += tyre * (length - slack) ** 2 / 2 - tyre * road * length
        c = 2 * zeta * np.sqrt(k * mass)
        F += c * (u[2 + 3 * i] ** 2 + u[3 + 3 * i] ** 2) / 2
        F += turning_damping * u[4 + 3 * i] ** 2 / 2 + tyre_damping * rate(length, q, u) ** 2 / 2
    udot = accelerations(q, u, T, V, F, t)
    model = mstmm.compile(mstmm.Scene(**scenes.half_car(k, zeta)), engine="looped")
    for time in (0.0, 0.3):
        at = random_values(rng, [0.05, 0.1, 1e-3, 1e-3, 0.3, 1e-3, 1e-3, 0.3])
        rates = random_values(rng, [1, 1, 0.1, 0.1, 3, 0.1, 0.1, 3])
        expected = udot(time, at, rates)
        found = model.accelerations(np.append(0.0, at), np.append(0.0, rates), time)
        assert found[0] == 0.0
        assert found[1:] == pytest.approx(expected, abs=1e-11 * np.abs(expected).max())


def test_quarter_car_is_where_its_linear_equations_say() -> None:
    case = CASES["d-quarter"]
    found, _ = references.load_reference(case)
    assert case.end_names == ("wheel", "plate", "car")
    assert found[:, 1] == pytest.approx(quarter_car_at(case.t_end), abs=1e-11)
    assert not found[:, [0, 2]].any()


def test_stored_rods_are_where_absolute_coordinates_say() -> None:
    case = CASES["a10-1e6"]
    assert case.bushings is not None
    tips, _ = BushedRods(*case.bushings).run(case.t_end, 1e-7, 1e4)
    found, _ = references.load_reference(case)
    assert np.abs(tips() - found).max() < 1e-6


def test_rods_in_absolute_coordinates_have_an_exact_jacobian(rng: np.random.Generator) -> None:
    rods = BushedRods(5, 1e6, 0.1)
    y = rods.initial_state + rng.uniform(-0.1, 0.1, len(rods.initial_state))
    columns = [np.imag(rods.rates(0.0, y + 1e-30j * unit)) / 1e-30 for unit in np.eye(len(y))]
    assert rods.jacobian(0.0, y).toarray() == pytest.approx(np.array(columns).T, rel=1e-13)


def test_every_case_has_a_reference_on_which_two_methods_agree() -> None:
    kept = json.loads(references.FILE.read_text())
    assert list(kept) == list(CASES)
    for name, case in CASES.items():
        found, apart = references.load_reference(case)
        assert apart < 1e-9, name
        assert np.isfinite(found).all() and found.shape == (len(case.end_names), 3)


@pytest.mark.parametrize("name", ["a10-1e4", "b4-spun", "d-half", "e"])
def test_references_can_be_computed_again(name: str) -> None:
    case = CASES[name]
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    result = model.simulate(
        case.t_end, method="dop853", rtol=1e-9, atol=1e-11, output_times=[case.t_end]
    )
    assert (
        np.abs(references.end_positions(result, case) - references.load_reference(case)[0]).max()
        < 1e-8
    )
