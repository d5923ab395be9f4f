"""Scenes of 1e5 degrees of freedom against a tridiagonal solution and their own balances."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

import mstmm
from mstmm.errors import SceneError
from mstmm.scene import Scene

Array = NDArray[np.float64]
Data = dict[str, Any]

LENGTH, MASS, INERTIA, GRAVITY = 0.7, 1.3, 0.06, 9.81


def rods(count: int, hinge: Data, name: str = "rope", inboard: str = "ground") -> Data:
    """Uniform rods along x."""
    body = {
        "mass": MASS, "center_of_mass": [LENGTH / 2, 0, 0], "inertia": [0.001, INERTIA, INERTIA],
        "ends": {"tip": [LENGTH, 0, 0]},
    }  # fmt: skip
    return {"name": name, "count": count, "inboard": inboard, "body": body, "hinge": hinge}


def scene(*chains: Data, gravity: float = GRAVITY) -> Scene:
    return Scene(gravity=[0, 0, -gravity], chain=list(chains))


def falling(count: int) -> Array:
    """Angular acceleration (n,) about +y of horizontal rods at rest, hung at their left end.

    Vertical forces V at the joints: m (a + b)/2 = V_k - V_k+1 - m g and J (b - a)/l =
    -l (V_k + V_k+1)/2 for the accelerations a, b of the ends of rod k; a of the next rod is b.
    """
    p, c = 1 / MASS, LENGTH**2 / (4 * INERTIA)
    bands = np.zeros((3, count))
    bands[0, 1:] = bands[2, :-1] = p - c
    bands[1] = -2 * (p + c)
    bands[0, 1], bands[1, 0] = c - p, p + c
    V = np.append(scipy.linalg.solve_banded((1, 1), bands, np.eye(1, count)[0] * GRAVITY), 0)
    return np.asarray(LENGTH / (2 * INERTIA) * (V[:-1] + V[1:]))


@pytest.mark.parametrize(
    ("hinge", "axis", "count"),
    [({"type": "pin", "axis": [0, 1, 0]}, 0, 40), ({"type": "ball"}, 1, 25),
     pytest.param({"type": "ball"}, 1, 33_334, marks=pytest.mark.slow),
     pytest.param({"type": "pin", "axis": [0, 1, 0]}, 0, 50_000, marks=pytest.mark.slow)],
)  # fmt: skip
def test_falling_rods(hinge: Data, axis: int, count: int) -> None:
    model = mstmm.compile(scene(rods(count, hinge)))
    found = model.accelerations(*model.initial_state()).reshape(count, -1)
    wanted = np.zeros_like(found)
    wanted[:, axis] = np.diff(falling(count), prepend=0.0)
    assert np.abs(found - wanted).max() < 1e-12 * np.abs(wanted).max()


@pytest.mark.slow
def test_a_chain_of_a_hundred_thousand_degrees_of_freedom_simulates() -> None:
    model = mstmm.compile(scene(rods(33_334, {"type": "ball"})))
    run = model.simulate(0.02, rtol=1e-6, atol=1e-9, output_times=[0.0, 0.01, 0.02])
    assert run.success and model.nu == 100_002
    falls = run.position("rope[last].tip")[:, 2] + 0.5 * GRAVITY * run.t**2
    assert np.abs(falls).max() < 1e-9  # the far end does not know yet that the rope is held
    certificate = run.certificate
    assert certificate.energy.relative < 1e-6 and certificate.pivot_loss is not None
    assert run.force("rope[0].hinge").shape == (3, 3)
    assert not certificate.warnings


@pytest.mark.slow
def test_a_tree_of_a_hundred_thousand_degrees_of_freedom_simulates() -> None:
    pin: Data = {"type": "pin", "axis": [0.3, 1, 0.2]}
    chains = [rods(1000, pin, "trunk")]
    for k in range(10):
        chains.append(rods(900, pin, f"branch{k}", f"trunk[{99 * k}].tip"))
        chains += [rods(1000, pin, f"twig{k}_{j}", f"branch{k}[{80 * j}].tip") for j in range(9)]
    model = mstmm.compile(scene(*chains))
    assert model.nu == 100_000
    q, u = model.initial_state()
    udot = model.accelerations(q, u)
    needed = model.inverse_dynamics(q, u, udot)
    weight = model.inverse_dynamics(q, u, np.zeros(model.nu))
    assert np.abs(needed).max() < 1e-12 * np.abs(weight).max()
    run = model.simulate(0.005, rtol=1e-5, atol=1e-8, output_times=[0.0, 0.005])
    assert run.success
    assert run.certificate.energy.relative < 1e-6


@pytest.mark.slow
def test_memory_grows_with_the_bodies_alone() -> None:
    """Python keeps nothing per member but numbers in arrays."""

    def peak(count: int) -> int:
        tracemalloc.start()
        model = mstmm.compile(scene(rods(count, {"type": "ball"})))
        model.accelerations(*model.initial_state())
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    peak(10)
    small, large = peak(2_000), peak(20_000)
    assert (large - small) / 18_000 < 4000  # bytes per body, the workspace among them
    assert large < 11 * small


def test_large_matrices_are_refused() -> None:
    model = mstmm.compile(scene(rods(20_001, {"type": "pin"})))
    q, _ = model.initial_state()
    with pytest.raises(SceneError, match=r"mass matrix: 20001 speeds need 3 GB"):
        model.mass_matrix(q)


def test_a_large_result_is_saved_without_what_follows_from_it(tmp_path: Any) -> None:
    model = mstmm.compile(scene(rods(5001, {"type": "pin", "axis": [0, 1, 0]})))
    run = model.simulate(0.01, rtol=1e-6, atol=1e-9, output_times=[0.0, 0.01])
    again = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert np.array_equal(again.q, run.q)
    assert np.array_equal(again.position("rope[last].tip"), run.position("rope[5000].tip"))
    assert "position" not in run.to_xarray()
    with pytest.raises(SceneError, match="too many columns"):
        run.save(tmp_path / "run.csv")
