"""What the derivatives of a mechanical system must be, whatever its numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.engine.tangent_matrix import TangentMatrix
from tests.reference.compare import seeded_scene, worst
from tests.reference.jets import Array
from tests.reference.random_scenes import random_scene
from tests.support.models import compile_scene


def pendulum(**hinge: Any) -> dict[str, Any]:
    """A rod on a pin about z, hanging along -y at angle -pi/2."""
    rod = {"name": "rod", "mass": 2.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.1, 0.3, 0.3]}
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"} | hinge
    return {"gravity": [0, -9.81, 0], "body": [rod], "hinge": [pin]}


@pytest.mark.parametrize("seed", range(4))
def test_efforts_see_the_inverse_mass_matrix(seed: int) -> None:
    scene, q, u = seeded_scene(300 + seed, most=5)
    model = compile_scene(scene)
    inverse = model.derivatives(q, u).efforts
    assert worst(inverse, inverse.T, floor=1e-3) < 1e-12
    assert np.linalg.eigvalsh((inverse + inverse.T) / 2).min(initial=1.0) > 0
    one = inverse @ model.mass_matrix(q)
    assert np.abs(one - np.eye(model.nu)).max(initial=0) < 1e-10


def test_driven_coordinates_do_not_answer() -> None:
    """Their row is the drive's alone; the others see the inverse of their own mass matrix."""
    scene = random_scene(5, types=("pin",), laws=False, loads=False, chain=True, most=4)
    scene["hinge"][0]["drive"] = "0.3*sin(2*t)"
    model = compile_scene(scene)
    driven = model.coordinate_layout.hinges[scene["hinge"][0]["name"]].u
    free = [k for k in range(model.nu) if k != driven]
    q, u = model.initial_state()
    t, step = 0.4, 1e-5
    found = model.derivatives(q, u, t)
    for name in ("q", "u", "efforts", "rate_u"):
        matrix = getattr(found, name)
        assert not matrix[driven].any() and not matrix[:, driven].any(), name
    assert abs(found.t[driven] + 8 * 0.3 * np.cos(2 * t)) < 1e-12
    ahead, behind = (model.accelerations(q, u, t + s) for s in (step, -step))
    assert worst(found.t, (ahead - behind) / (2 * step)) < 1e-7
    moved = np.array(q)
    moved[model.coordinate_layout.hinges[scene["hinge"][0]["name"]].q] = 0.3 * np.sin(2 * t)
    mass = model.mass_matrix(moved)[np.ix_(free, free)]
    assert worst(found.efforts[np.ix_(free, free)] @ mass, np.eye(len(free))) < 1e-11


def cross(v: Array) -> Array:
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def test_increments_of_quaternions_turn_with_the_body() -> None:
    """dphi' = domega - omega x dphi; dp' = dv - v x dphi - omega x dp, outboard axes."""
    scene = random_scene(2, types=("free", "ball"), laws=False, most=2)
    scene["hinge"][0]["type"] = "free"
    model = compile_scene(scene)
    rng = np.random.default_rng(3)
    q, _ = model.initial_state()
    u = rng.normal(size=model.nu)
    for start in model.coordinate_layout.quaternions:
        q[start : start + 4] = rng.normal(size=4)  # of any length
    found = model.derivatives(q, u)
    assert worst(found.rate_u, np.eye(model.nu)) < 1e-14
    for slots in model.coordinate_layout.hinges.values():
        own = u[slots.u_slice]
        wanted = np.zeros((slots.nu, slots.nu))
        wanted[-3:, -3:] = -cross(own[-3:])
        if slots.nu == 6:
            wanted[:3, :3], wanted[:3, 3:] = -cross(own[3:]), -cross(own[:3])
        assert np.abs(found.rate_q[slots.u_slice, slots.u_slice] - wanted).max() < 1e-13
        found.rate_q[slots.u_slice, slots.u_slice] = 0
    assert not found.rate_q.any()


def test_the_length_of_a_quaternion_does_not_matter() -> None:
    scene, q, u = seeded_scene(12, types=("ball", "free"), most=3)
    model = compile_scene(scene)
    longer = q.copy()
    for start in model.coordinate_layout.quaternions:
        longer[start : start + 4] *= 1.7
    one, other = model.derivatives(q, u), model.derivatives(longer, u)
    for name in ("q", "u", "efforts", "rate_q"):
        assert worst(getattr(other, name), getattr(one, name), floor=1.0) < 1e-11, name


def test_small_oscillations_of_a_pendulum() -> None:
    """Frequency sqrt(m g l / J) and the damping ratio of a damped pin, J about the pin."""
    model = compile_scene(pendulum(law={"damping": 0.4}))
    inertia = 0.3 + 2.0 * 0.25
    found = model.derivatives([-np.pi / 2], [0.0])
    assert abs(found.q[0, 0] + 2.0 * 9.81 * 0.5 / inertia) < 1e-13
    assert abs(found.u[0, 0] + 0.4 / inertia) < 1e-15
    wanted = np.roots([inertia, 0.4, 2.0 * 9.81 * 0.5])
    eigenvalues = np.linalg.eigvals(found.state_matrix)
    assert worst(np.sort_complex(eigenvalues).imag, np.sort_complex(wanted).imag) < 1e-13
    assert worst(np.sort_complex(eigenvalues).real, np.sort_complex(wanted).real) < 1e-12


def test_conservative_motions_near_equilibrium_neither_grow_nor_decay() -> None:
    """At rest M d(udot)/dq is symmetric (a potential) and d(udot)/du vanishes."""
    scene = random_scene(40, types=("pin", "universal", "prismatic"), laws=False, loads=False)
    for hinge in scene["hinge"]:
        count = {"universal": 2}.get(hinge["type"], 1)
        hinge["law"] = {"stiffness": [300.0] * count, "inertia": [0.0] * count}
    model = compile_scene(scene)
    q = model.equilibrium()
    found = model.derivatives(q, np.zeros(model.nu))
    stiffness = model.mass_matrix(q) @ found.q
    assert worst(stiffness, stiffness.T) < 1e-10
    assert not found.u.any()
    assert np.linalg.eigvals(found.q).real.max() < 0


def test_scenes_without_coordinates() -> None:
    model = compile_scene(pendulum(type="fixed"))
    found = model.derivatives([], [], parameters=["rod.mass"])
    assert found.q.shape == (0, 0) and found.parameters["rod.mass"].shape == (0,)
    assert found.state_matrix.shape == (0, 0)


# --- what cannot be had ---------------------------------------------------------------------------


def test_an_unknown_name_suggests_the_nearest() -> None:
    with pytest.raises(SceneError, match=r'"rod\.mas": there is no such number.*"rod\.mass"'):
        compile_scene(pendulum()).derivatives([0.0], [0.0], parameters=["rod.mas"])


def test_a_list_needs_an_index() -> None:
    with pytest.raises(SceneError, match=r'"rod\.center_of_mass": there is no such number'):
        compile_scene(pendulum()).derivatives([0.0], [0.0], parameters=["rod.center_of_mass"])


def test_a_wrong_shape_is_named() -> None:
    with pytest.raises(SceneError, match=r"q has shape \(2,\), expected \(..., 1\)"):
        compile_scene(pendulum()).derivatives([0.0, 1.0], [0.0])


def test_a_slope_that_does_not_exist_is_a_failure() -> None:
    model = compile_scene(pendulum(law={"effort": "sqrt(q)"}))
    assert np.isfinite(model.accelerations([0.0], [0.0])).all()
    with pytest.raises(NumericalFailure, match=r"derivative of pin\.angle_rate's acceleration"):
        model.derivatives([0.0], [0.0])


def test_a_release_is_refused() -> None:
    model = compile_scene(pendulum(drive="0", release="t >= 1"))
    with pytest.raises(SceneError, match='hinge "pin" is released during the run'):
        model.derivatives([0.0], [0.0])


def parents_and_places(scene: dict[str, Any]) -> tuple[list[int], list[int]]:
    """Parents of the bodies, and the places in which the tangent keeps their S."""
    model = compile_scene(scene)
    TangentMatrix(model.looped)
    packed = model.looped.packed
    bodies = packed.model.bodies
    count = packed.system.count
    return [bodies[i].parent for i in range(count)], [bodies[i].carried for i in range(count)]


def test_long_chains_carry_in_a_few_places() -> None:
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.1, 0.1, 0.1],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    chain = {"name": "rope", "count": 500, "inboard": "ground", "body": rod,
             "hinge": {"type": "pin"}}  # fmt: skip
    _, places = parents_and_places({"gravity": [0, -9.81, 0], "chain": [chain]})
    assert len(set(places)) < 20


@pytest.mark.parametrize("seed", range(6))
def test_nobody_waits_where_another_does(seed: int) -> None:
    """A place is taken again by bodies that are begun once its body is eliminated."""
    parents, places = parents_and_places(seeded_scene(700 + seed, most=90)[0])
    children: dict[int, list[int]] = {}
    for body, parent in enumerate(parents):
        children.setdefault(parent, []).append(body)
    for body, place in enumerate(places):
        for other in range(body + 1, len(places)):
            if places[other] == place:
                assert max(children.get(body, [0])) < other
