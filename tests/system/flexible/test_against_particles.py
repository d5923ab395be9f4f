"""Beams of the engine against the dense system of particles, on random chains and trees.

The reference sums over particles, writes ports and hinges as positions in Taylor arithmetic and
solves one saddle-point system; it shares no formula with the engine.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.flexible.flexible_bodies import modal_bodies
from tests.reference.compare import worst
from tests.reference.flexible import dense, random_beams
from tests.reference.flexible.beam import flexible_body, mean_section

ACCURACY = 1e-10
TIME = 0.3


def compare(
    scene: dict[str, Any], seed: int, engine: str = "looped", particles: bool = False
) -> None:
    """Accelerations, hinge loads and energy at one state."""
    print(f"random_beams seed = {seed}")
    q, u = random_beams.random_state(scene, seed)
    model = mstmm.compile(mstmm.Scene(**scene), engine=engine)
    found = dense.solve(scene, q, u, TIME, lagrangian=not particles)
    assert worst(model.accelerations(q, u, t=TIME), found.udot) < ACCURACY
    result = model.simulate(t_start=TIME, t_end=TIME, initial=(q, u))
    assert result.success, result.message
    names = [hinge["name"] for hinge in scene["hinge"]]
    wrenches = [np.concatenate([result.force(n)[0], result.moment(n)[0]]) for n in names]
    assert worst(wrenches, np.hstack([found.force, found.moment]), floor=1.0) < ACCURACY
    energy = dense.energy(scene, q, u)
    assert abs(result.energy()[0] - energy) < ACCURACY * max(abs(energy), 1.0)


#: Of seeds beyond the first.
MORE = [pytest.param(seed, marks=pytest.mark.soak) for seed in range(5, 20)]


@pytest.mark.parametrize("seed", [*range(5), *MORE])
def test_spatial_trees(seed: int) -> None:
    compare(random_beams.random_system(seed), seed)


@pytest.mark.parametrize("seed", [*range(5), *MORE])
def test_planar_trees(seed: int) -> None:
    compare(random_beams.random_system(seed, planar=True), seed)


@pytest.mark.parametrize("draw", range(4))
def test_trees_drawn_afresh(draw: int, rng: np.random.Generator) -> None:
    seed = int(rng.integers(2**32))
    compare(random_beams.random_system(seed, planar=draw % 2 == 0), seed)


@pytest.mark.parametrize("seed", range(30, 32))
def test_long_chains(seed: int) -> None:
    compare(random_beams.random_system(seed, chain=True, most=9), seed)


@pytest.mark.parametrize("seed", range(40, 43))
def test_without_stiffening_particles_are_the_same(seed: int) -> None:
    """Linear fields: the sum over particles needs no cut at all."""
    scene = random_beams.random_system(seed, most=3, stiffening=False)
    compare(scene, seed, particles=True)


@pytest.mark.parametrize("seed", (50,))
def test_fused_engine(seed: int) -> None:
    compare(random_beams.random_system(seed, most=2), seed, engine="fused")


@pytest.mark.parametrize("seed", range(60, 64))
def test_numbers_of_a_beam(seed: int) -> None:
    """Moments, stiffness and ends of a beam against sums over its particles, in every frame."""
    scene = random_beams.random_system(seed, planar=seed % 2 == 0)
    held = {
        h["outboard"].partition(".")[0]: h["outboard"].partition(".")[2] for h in scene["hinge"]
    }
    bodies = modal_bodies(mstmm.Scene(**scene))
    for beam in scene["beam"]:
        made = bodies[beam["name"]]
        body = flexible_body(beam, held[beam["name"]])
        p = body.particles
        expected = {
            "mass": p.mass.sum(),
            "first": p.mass @ p.place,
            "second": np.einsum("m,ma,mb->ab", p.mass, p.place, p.place),
            "C": np.einsum("m,mak->ak", p.mass, p.phi),
            "E": np.einsum("m,ma,mbk->abk", p.mass, p.place, p.phi),
            "F": np.einsum("m,mak,mbl->abkl", p.mass, p.phi, p.phi),
            "K": body.K,
            "D": body.D,
        }
        for name, value in expected.items():
            assert worst(getattr(made, name), value, floor=1.0) < 1e-12, name
        drawn = np.einsum("m,makl->akl", p.mass, p.second)
        moved = np.einsum("m,ma,mbkl->abkl", p.mass, p.place, p.second)
        assert worst(made.G, -drawn, floor=1.0) < 1e-12
        assert worst(made.X, -moved, floor=1.0) < 1e-12
        for name, port in made.ports.items():
            if name in body.ends:
                section = body.ends[name]
            else:  # the mean of the sections that a load per length acts on
                (span,) = (one["span"] for one in scene["load"] if "span" in one)
                section = mean_section(body, beam, *span)
            assert worst(port.position, section.place) < 1e-13
            assert worst(port.rotation, section.rotation) < 1e-13
            assert worst(port.phi, section.phi, floor=1.0) < 1e-12
            assert worst(port.theta, section.theta, floor=1.0) < 1e-12
            assert worst(port.second_order, -section.second, floor=1.0) < 1e-12
