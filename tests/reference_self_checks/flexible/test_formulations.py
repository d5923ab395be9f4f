"""The references agree with each other and with exact results, and need nothing of mstmm."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from tests.reference import hinges
from tests.reference.compare import worst
from tests.reference.flexible import closed_forms, dense, random_beams, shapes
from tests.reference.flexible import finite_elements as fe
from tests.reference.flexible.inextensible import (
    Beam,
    extrapolated_limit,
    segments,
    spectral,
    spin_up,
)
from tests.support.paths import ROOT, TESTS


def test_references_run_without_the_engine() -> None:
    names = sorted(path.stem for path in (TESTS / "reference" / "flexible").glob("*.py"))
    imports = "".join(f"import tests.reference.flexible.{n}\n" for n in names if n != "__init__")
    use = (
        "import sys\n"
        "from tests.reference.flexible import dense, random_beams\n"
        "scene = random_beams.random_system(1)\n"
        "dense.solve(scene, *random_beams.random_state(scene, 1))\n"
        "loaded = [name for name in sys.modules if name.partition('.')[0] == 'mstmm']\n"
        "assert not loaded, loaded\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", imports + use], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr


@pytest.mark.parametrize("lagrangian", (True, False))
@pytest.mark.parametrize("seed", (2, 6))
def test_power_balance_of_the_particles(seed: int, lagrangian: bool) -> None:
    """Without laws, damping and loads the energy's rate along the motion is zero."""
    scene = random_beams.random_system(seed, most=3)
    scene["load"] = []
    for hinge in scene["hinge"]:
        hinge.pop("law", None)
    for beam in scene["beam"]:
        beam["damping"], beam["viscous_drag"] = {"stiffness": 0.0}, 0.0
    q, u = random_beams.random_state(scene, seed)
    udot = dense.solve(scene, q, u, lagrangian=lagrangian).udot
    this, qdot = dense.system(scene, lagrangian), np.zeros_like(q)
    tree = this.tree
    for hinge in tree.hinges:
        own = u[hinge.u]
        qdot[hinge.q] = hinges.coordinate_jet(hinge, q[hinge.q], own, 0 * own).dx
    qdot[tree.nq :] = u[tree.nu :]

    def energy(h: float) -> float:
        return dense.energy(this, q + h * qdot, u + h * udot)

    h = 2e-4
    rate = (8 * (energy(h) - energy(-h)) - energy(2 * h) + energy(-2 * h)) / (12 * h)
    assert abs(rate) < 1e-8 * np.abs(udot).max() * max(abs(energy(0.0)), 1.0)


def test_both_forms_are_one_without_stiffening() -> None:
    scene = random_beams.random_system(5, stiffening=False)
    q, u = random_beams.random_state(scene, 5)
    particles = dense.solve(scene, q, u, lagrangian=False).udot
    assert worst(dense.solve(scene, q, u).udot, particles) < 1e-11


def test_shapes_of_the_textbook() -> None:
    x, w = np.polynomial.legendre.leggauss(60)
    x, w = (x + 1) / 2, w / 2
    for kind in ("clamped-free", "free-free", "clamped-clamped"):
        values = np.array([shapes.vibration(kind, k)(x, 0) for k in range(1, 13)])
        bent = np.array([shapes.vibration(kind, k)(x, 2) for k in range(1, 13)])
        roots = np.array([float(shapes.root(kind, k)) for k in range(1, 13)])
        assert worst((values * w) @ values.T, np.eye(12)) < 1e-12
        assert worst((bent * w) @ bent.T, np.diag(roots**4)) < 1e-12


def test_segments_and_polynomials_find_the_same_spin_up() -> None:
    beam, times = Beam(10.0, 1.4e4, 1.2), np.linspace(0.0, 5.0, 6)
    exact = spectral([beam], 5, clamped=True).with_driven_base(spin_up(6.0)).tips(times, 1e-8)
    tips = [
        segments([beam], n, clamped=True).with_driven_base(spin_up(6.0)).tips(times, 1e-8)
        for n in (4, 8)
    ]
    assert worst(extrapolated_limit(tips)[0], exact) < 2e-5


def test_segments_and_polynomials_find_the_same_welded_fall() -> None:
    beams = [Beam(0.6, 5.0), Beam(0.5, 5.0, joint="weld", angle=np.pi / 2, tip_mass=0.2)]
    times = np.linspace(0.0, 0.2, 3)
    exact = spectral(beams, 5, 9.81).tips(times, 1e-7)
    tips = [segments(beams, n, 9.81).tips(times, 1e-7) for n in (4, 8)]
    assert worst(extrapolated_limit(tips)[0], exact) < 1e-4


def test_stability_limits_of_finite_elements() -> None:
    assert abs(fe.self_weight_buckling(30) / closed_forms.SELF_WEIGHT_BUCKLING - 1) < 1e-7
    assert abs(fe.beck() - 20.0509) < 1e-3  # Beck 1952: 20.05
    assert abs(fe.thrust() - 109.69) < 2e-2


def test_heavy_chain_is_the_limit_of_the_hanging_beam() -> None:
    chain = closed_forms.HEAVY_CHAIN * np.sqrt(9.81)
    assert abs(fe.hanging(1e-6, 9.81, 1)[0] / chain - 1) < 2e-3
