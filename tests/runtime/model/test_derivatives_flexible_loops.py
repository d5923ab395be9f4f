"""Exact derivatives of accelerations of mechanisms that bend, along motions that keep loops
closed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.support.models import looped_model
from tests.system.loops.test_flexible_against_tree import Scene, shackled_beam, slider_crank

#: Of closed states beside the one at hand, and of speeds there; halved once.
STEPS = {"q": 2e-4, "u": 2e-3}


def by_differences(side: Callable[[float], list[Array]], step: float) -> list[Array]:
    """Slopes of several arrays, after Richardson."""

    def central(h: float) -> list[Array]:
        return [(a - b) / (2 * h) for a, b in zip(side(h), side(-h), strict=True)]

    whole, half = central(step), central(step / 2)
    return [(4 * b - a) / 3 for a, b in zip(whole, half, strict=True)]


@pytest.mark.parametrize("scene", [slider_crank, shackled_beam], ids=["crank", "shackle"])
def test_along_closed_motions(scene: Callable[[], Scene], rng: np.random.Generator) -> None:
    """In motion, along every independent motion and speed."""
    model = looped_model(scene())
    freedom, q, u = model.independent_speeds, *model.initial_state()
    assert freedom is not None
    places = freedom.indices
    ways = freedom.motion_matrix(q, places)
    own = u[list(places)] + rng.normal(scale=0.5, size=len(places))
    found = model.derivatives(q, ways @ own)
    assert worst(found.efforts, model.solve(q, np.eye(model.nu))) < 1e-11

    def state(x: Array, faster: Array) -> list[Array]:
        moved = model.assemble(q + ways @ x)[0] if x.any() else q
        speeds = freedom.motion_matrix(moved, places) @ (own + faster)
        return [moved, speeds, model.accelerations(moved, speeds)]

    still = np.zeros(len(places))
    for unit in np.eye(len(places)):
        for sides, step in (
            (lambda h, unit=unit: state(h * unit, still), STEPS["q"]),
            (lambda h, unit=unit: state(still, h * unit), STEPS["u"]),
        ):
            d_q, d_u, wanted = by_differences(sides, step)
            assert worst(found.q @ d_q + found.u @ d_u, wanted) < 1e-8


def test_by_numbers_of_the_scene() -> None:
    model = looped_model(slider_crank())
    q, u = model.initial_state()
    names = ["slider.mass", "gravity[1]", "crank.mass"]
    found = model.derivatives(q, u, parameters=names).parameters
    for name in names:
        value = model.parameters[name]

        def side(h: float, name: str = name, value: float = value) -> list[Array]:
            return [model.with_parameters({name: value + h}).accelerations(q, u)]

        assert worst(found[name], by_differences(side, 1e-3)[0]) < 1e-8


@pytest.mark.parametrize("scene", [slider_crank, shackled_beam], ids=["crank", "shackle"])
def test_those_of_linear_models(scene: Callable[[], Scene]) -> None:
    """At rest, bent by weight: -M^-1 K and -M^-1 C along the independent motions."""
    made = scene()
    made["beam"][0]["damping"] = 0.03
    model: mstmm.Model = looped_model(made)
    linear = model.linearize()
    assert linear.constrained_motion is not None
    along, places = linear.constrained_motion.motion_basis, list(linear.free_speed_indices)
    found = model.derivatives(linear.state.q, linear.state.u)
    both = np.hstack([(found.q @ along)[places], (found.u @ along)[places]])
    assert worst(both, linear.A[len(places) :]) < 1e-11
