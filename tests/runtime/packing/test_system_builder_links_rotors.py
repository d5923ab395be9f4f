"""Rotors on hinges of one speed: swept as links, as the inertia that they add says."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm

BODIES = 9


def chain(kind: str, rotors: list[float], driven: int = -1) -> mstmm.Scene:
    """Bodies in skew frames in a row, each with its rotor."""
    bodies = [
        {"name": f"b{i}", "mass": 1.0 + 0.1 * i, "center_of_mass": [0.3, 0.1, 0.05],
         "inertia": [0.1, 0.12, 0.11, 0.01, 0, 0], "ends": {"tip": [0.7, 0.1, 0.2]}}
        for i in range(len(rotors))
    ]  # fmt: skip
    screw = {"lead": 0.3} if kind == "screw" else {}
    hinges = [
        {"name": f"h{i}", "type": kind, "inboard": f"b{i - 1}.tip" if i else "ground",
         "outboard": f"b{i}", "axis": [i % 2, 0.3, 1.0], **screw,
         **({"law": {"inertia": [rotor]}} if rotor else {}),
         **({"drive": ["0"]} if i == driven else {})}
        for i, rotor in enumerate(rotors)
    ]  # fmt: skip
    return mstmm.Scene(gravity=[0.4, 0, -9.81], body=bodies, hinge=hinges)


@pytest.mark.parametrize("kind", ["pin", "prismatic", "screw"])
@pytest.mark.parametrize("every", [1, 3])
def test_rotors_add_to_the_mass_matrix(kind: str, every: int, rng: np.random.Generator) -> None:
    rotors = [0.2 * (1 + i % 4) if i % every == 0 else 0.0 for i in range(BODIES)]
    model = mstmm.compile(chain(kind, rotors), engine="looped")
    plain = mstmm.compile(chain(kind, [0.0] * BODIES), engine="looped")
    runs = model.packed_scene.written.model
    assert runs.n_runs == (1 if every == 1 else 6)
    assert all(runs.runs[k].numbers for k in range(runs.n_runs))
    for _ in range(5):
        q, u, efforts = rng.uniform(-1, 1, (3, BODIES))
        mass = plain.mass_matrix(q) + np.diag(rotors)
        assert model.mass_matrix(q) == pytest.approx(mass, rel=1e-12, abs=1e-12)
        bias = plain.inverse_dynamics(q, u, np.zeros(BODIES))
        expected = np.linalg.solve(mass, efforts - bias)
        found = model.accelerations(q, u, 0.0, efforts)
        assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()


def test_a_driven_hinge_with_a_rotor_is_no_link() -> None:
    model = mstmm.compile(chain("pin", [0.2, 0.3, 0.4], driven=1), engine="looped")
    plain = mstmm.compile(chain("pin", [0.0] * 3), engine="looped")
    q, u = model.initial_state()
    held, free = model.accelerations(q, u), [0, 2]
    mass = (plain.mass_matrix(q) + np.diag([0.2, 0.3, 0.4]))[np.ix_(free, free)]
    bias = plain.inverse_dynamics(q, u, np.zeros(3))[free]
    assert held[1] == 0.0
    assert held[free] == pytest.approx(np.linalg.solve(mass, -bias), rel=1e-12)
