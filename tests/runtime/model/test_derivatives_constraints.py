"""Exact derivatives of what constraints close, and how fast a disc must roll to stay upright."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.support.models import compile_scene
from tests.support.scenes.constraints import (
    GRAVITY,
    MASS,
    RADIUS,
    cycloid,
    governor,
    on_a_plane,
    on_a_road,
)

STEP = 1e-5
SCENES = {"distances": governor("constraint"), "plane": on_a_plane(), "disc": on_a_road(),
          "wire": cycloid(0.4)}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_along_closed_motions(name: str) -> None:
    """By central differences between states of the same independent speeds and others."""
    model, draw = compile_scene(SCENES[name]), np.random.default_rng(4)
    freedom, closed = model.independent_speeds, model.loop_start
    assert freedom is not None and closed is not None
    q, places = model.initial_state()[0], freedom.indices
    x, v, dv = draw.normal(size=(3, len(places)))
    driven = np.zeros(model.nu)
    driven[sorted({*range(model.nu)} - {*model.free_speed_indices})] = 10.0

    def displaced_state(size: float) -> tuple[Array, Array]:
        moved = closed.assemble(q + size * rates, 0 * driven, (), ())[0]
        u = driven + freedom.motion_matrix(moved, places) @ (v + size * dv)
        u = closed.assemble(moved, u, (), ())[1]
        return u, model.accelerations(moved, u)

    ways = freedom.motion_matrix(q, places)
    rates = model.looped.rates(0.0, q, ways @ x, model.looped.start_memory())
    forward, back, here = displaced_state(STEP), displaced_state(-STEP), displaced_state(0.0)
    found = model.derivatives(q, here[0])
    d_u, wanted = (a - b for a, b in zip(forward, back, strict=True))
    assert worst(found.q @ (2 * STEP * ways @ x) + found.u @ d_u, wanted) < 1e-6


def test_by_numbers_of_the_scene() -> None:
    """The mass of the disc and gravity."""
    model = compile_scene(on_a_road())
    q, u = model.initial_state()
    names = ["disc.mass", "gravity[2]"]
    found = model.derivatives(q, u, parameters=names).parameters
    for name in names:
        value = model.parameters[name]
        sides = [
            model.with_parameters({name: value + s}).accelerations(q, u) for s in (STEP, -STEP)
        ]
        assert worst(found[name], (sides[0] - sides[1]) / (2 * STEP)) < 1e-7


def test_by_numbers_of_constraints() -> None:
    """The radius of the disc, which begins at rest as no speed goes with all radii."""
    scene, (q, u) = on_a_road(), compile_scene(on_a_road()).initial_state()
    del scene["hinge"][0]["initial"]["u"]
    model = compile_scene(scene)
    found = model.derivatives(q, u, parameters=["road.radius"]).parameters["road.radius"]
    sides = [model.with_parameters({"road.radius": RADIUS + s}).accelerations(q, u)
             for s in (STEP, -STEP)]  # fmt: skip
    assert np.abs(found).max() > 1.0
    assert worst(found, (sides[0] - sides[1]) / (2 * STEP)) < 1e-7
    with pytest.raises(
        mstmm.SceneError, match=r'"road.normal\[0\]": .* start of a constraint, have no exact'
    ):
        model.derivatives(q, u, parameters=["road.normal[0]"])


def test_lengths_are_numbers_of_the_scene() -> None:
    """Rods of 0.31 m from arms of 0.3 m to the sleeve below."""
    longer = {f"constraint{k}.length": 0.31 for k in (1, 2)}
    arms = compile_scene(SCENES["distances"]).with_parameters(longer)
    q, places = arms.initial_state()[0], arms.coordinate_layout.hinges
    arm = 0.3 * np.exp(1j * q[places["hip0"].q])
    below = arm.imag + math.sqrt(0.31**2 - arm.real**2)
    assert q[places["slide"].q] == pytest.approx(-below, abs=1e-9)


def gimballed_disc() -> mstmm.Model:
    """The disc on hinges whose coordinates do not turn as it rolls: x, y, z, yaw, lean, spin."""
    moment = MASS * RADIUS**2 / 4
    inertia = [moment, 2 * moment, moment]
    names = ["x", "y", "z", "yaw", "lean", "spin"]
    axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [1, 0, 0], [0, 1, 0]]
    bodies: list[dict[str, Any]] = [{"name": f"part_{name}", "mass": 0.0} for name in names[:-1]]
    hinges: list[dict[str, Any]] = [
        {"name": name, "type": "prismatic" if k < 3 else "pin", "axis": axis,
         "inboard": f"part_{names[k - 1]}" if k else "ground", "outboard": f"part_{name}"}
        for k, (name, axis) in enumerate(zip(names, axes, strict=True))
    ]  # fmt: skip
    hinges[-1]["outboard"] = "disc"
    hinges[2]["initial"] = {"q": RADIUS}
    return compile_scene(on_a_road() | {
        "body": [*bodies, {"name": "disc", "mass": MASS, "inertia": inertia}], "hinge": hinges,
    })  # fmt: skip


@pytest.mark.parametrize("share", [0.5, 0.98, 1.02, 2.0])
def test_how_fast_a_disc_stays_upright(share: float) -> None:
    """Lean and yaw rate obey (I + m r^2) lean'' = m g r lean - (J + m r^2) spin yaw' and
    I yaw'' = J spin lean' with J = 2 I = m r^2 / 2: it stays upright where v^2 > g r / 3."""
    model, speed = gimballed_disc(), math.sqrt(share * GRAVITY * RADIUS / 3)
    q, spin = model.initial_state()[0], speed / RADIUS
    u = np.array([speed, 0, 0, 0, 0, spin])
    matrix = model.derivatives(q, u).state_matrix
    # Independent: x, y, yaw, lean, turn; then the rates of the last three.
    ways = np.zeros((12, 8))
    ways[[0, 1, 3, 4, 5], range(5)] = ways[[9, 10, 11], [5, 6, 7]] = 1.0
    ways[7, 2], ways[7, 6], ways[6, 7] = speed, -RADIUS, RADIUS
    left = np.linalg.pinv(ways) @ matrix @ ways
    assert worst(matrix @ ways, ways @ left) < 1e-10
    found = np.linalg.eigvals(left)
    square = (GRAVITY / RADIUS - 3 * spin**2) * 4 / 5
    wanted = math.sqrt(square) if square > 0 else 0.0
    assert found.real.max() == pytest.approx(wanted, abs=1e-6)
    if square < 0:
        assert np.abs(found.imag).max() == pytest.approx(math.sqrt(-square), rel=1e-9)
