"""Constraints by implicit methods: Kane's equations of a disc, Huygens' pendulum, orders."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.integrate

import mstmm
from tests.reference.algebra import attitude
from tests.support.models import compile_scene
from tests.support.scenes.constraints import GRAVITY, cycloid, disc, governor, kane

METHODS = ("rodas4p2", "rodas5p", "kvaerno5", "genalpha")


@pytest.fixture(scope="module")
def leaning() -> float:
    """Sine of the lean of the disc after 1 s, by Kane's equations and SciPy."""

    def rates(t: float, y: np.ndarray[tuple[int], np.dtype[np.float64]]) -> list[float]:
        lean, *u = y
        matrix, forcing = kane()(lean, *u)
        return [u[0], *np.linalg.solve(matrix, forcing)[:, 0]]

    start = [0.3, 0.0, 8.0, 0.0]
    found = scipy.integrate.solve_ivp(rates, (0.0, 1.0), start, "DOP853", rtol=1e-12, atol=1e-13)
    return math.sin(float(found.y[0, -1]))


@pytest.mark.parametrize("method", METHODS)
def test_a_rolling_disc_against_kane(method: str, leaning: float) -> None:
    """By its own steps; the second-order method by equal ones."""
    options: dict[str, Any] = (
        {"step": 1e-3} if method == "genalpha" else {"rtol": 1e-9, "atol": 1e-11}
    )
    result = disc().simulate(1.0, method, output_times=[0.0, 1.0], **options)
    assert result.success, result.message
    error = abs(attitude(result.q[-1][3:])[2, 1] - leaning)
    assert error < (1e-3 if method == "genalpha" else 1e-7)


@pytest.mark.parametrize(("method", "order"), [("rodas5p", 5), ("esdirk436", 4), ("genalpha", 2)])
def test_orders_of_a_governor(method: str, order: int) -> None:
    """Distances among driven hinges."""
    model = compile_scene(governor("constraint"))
    wanted = model.simulate(0.4, rtol=1e-12, atol=1e-13, output_times=[0.0, 0.4]).q[-1]
    errors = [
        float(np.abs(model.simulate(0.4, method, step=0.4 / n).q[-1] - wanted).max())
        for n in (16, 32)
    ]
    assert np.log2(errors[0] / errors[1]) > order - 0.35, errors


@pytest.mark.parametrize("method", ["rodas5p", "auto"])
def test_a_bead_on_a_cycloid(method: str) -> None:
    """Swings in a time that is always the same (Huygens)."""
    a, start = 0.5, 2.2
    times = np.linspace(0.0, 2.0, 5)
    result = compile_scene(cycloid(start, a)).simulate(2.0, method, rtol=1e-8, output_times=times)
    assert result.success, result.message
    wanted = 4 * a * math.sin(start / 2) * np.cos(math.sqrt(GRAVITY / (4 * a)) * times)
    assert np.abs(4 * a * np.sin(result.q[:, 7] / 2) - wanted).max() < 1e-6


def test_a_stiff_spring_at_a_rod_takes_implicit_steps() -> None:
    """A rod that is a distance beside one that is a stiff, damped spring."""
    scene = governor("constraint")
    stiff = {"stiffness": 1e9, "damping": 3e4, "rest": 0.3}
    scene["spring"] = [{"from": "arm1.ball", "to": "sleeve", "law": stiff}]
    del scene["constraint"][1]
    model = mstmm.compile(mstmm.Scene(**scene))
    result = model.simulate(0.3, "auto", rtol=1e-5, output_times=[0.0, 0.3])
    assert result.success, result.message
    assert [one.method for one in result.method_history][:2] == ["dop853", "rodas4p2"]
    rigid = compile_scene(governor("constraint")).simulate(0.3, rtol=1e-9, output_times=[0.0, 0.3])
    assert np.abs(result.q[-1] - rigid.q[-1]).max() < 1e-3


def test_own_coordinates_go_by_the_name_of_their_constraint(tmp_path: Path) -> None:
    model = compile_scene(cycloid(0.4))
    names = model.coordinate_layout.q_names
    assert len(names) == model.nq and names[-1] == "wire.s" == model.coordinate_layout.q_name(
        model.nq - 1
    )
    assert (
        model.coordinate_layout.u_names[-1]
        == "wire.s_rate"
        == model.coordinate_layout.u_name(model.nu - 1)
    )
    result = model.simulate(0.1, "dop853")
    again = mstmm.load_result(result.save(tmp_path / "run.nc"))
    assert np.array_equal(again.q, result.q) and again.q.shape[1] == model.nq
