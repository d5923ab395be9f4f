"""Code for one scene with couplings, and exact derivatives."""

from __future__ import annotations

import copy

import numpy as np

import mstmm
from tests.reference.compare import worst
from tests.reference.random_couplings import random_coupled
from tests.support.scenes.gears import Scene, coupled_model, inertia, pair, pin, planetary, wheel


def _fused_model(model: mstmm.Model) -> mstmm.Model:
    return mstmm.compile(model.scene, engine="fused")


def test_a_mechanism() -> None:
    """Rows of speeds that name a hinge which closes a loop, a free body and a ball among them."""
    scene, q, u = random_coupled(6)
    looped = mstmm.compile(mstmm.Scene(**copy.deepcopy(scene)))
    fused = _fused_model(looped)
    assert fused.engine == "fused"
    assert worst(fused.accelerations(q, u), looped.accelerations(q, u)) < 1e-11
    run: Scene = {"rtol": 1e-9, "initial": (q, u), "output_times": [0.0, 0.2]}
    found, wanted = (model.simulate(0.2, "dop853", **run) for model in (fused, looped))
    assert found.success, found.message
    assert worst(found.q[-1], wanted.q[-1]) < 1e-10
    assert found.certificate.energy.relative < 1e-8


def test_trajectories_side_by_side() -> None:
    """Redundant rows of planets; each trajectory is that of a run alone."""
    model = _fused_model(planetary({}, sun={"stiffness": 3.0}, carrier={"stiffness": 20.0}))
    starts = [
        model.assemble([angle, 0, 0.1, 0, 0, 0], np.zeros(6), hold=["sun", "carrier"])
        for angle in (0.1, 0.2, 0.3)
    ]
    states = np.array([q for q, _ in starts]), np.array([u for _, u in starts])
    batch = model.simulate_batch(states, t_end=0.1, rtol=1e-9, output_times=[0.0, 0.1])
    assert batch.success.all()
    for k, start in enumerate(starts):
        alone = model.simulate(0.1, "dop853", rtol=1e-9, initial=start, output_times=[0.0, 0.1])
        assert np.abs(batch.q[k, -1] - alone.q[-1]).max() < 1e-7


def test_trajectories_side_by_side_go_by_time() -> None:
    """What a coupling asks for at each time, shared out by the moments of inertia: closed form."""
    model = _fused_model(
        pair({"name": "gear", "expression": "A.q + 3*B.q", "equals": "0.2*sin(3*t)"})
    )
    times = np.linspace(0.25, 1.0, 4)
    asked, rate = 0.2 * np.sin(3 * times), 0.6 * np.cos(3 * times)
    q, u = np.array([0.0, asked[0] / 3]), np.array([0.1, (rate[0] - 0.1) / 3])
    batch = model.simulate_batch((q[None], u), t_start=0.25, t_end=1.0, output_times=times)
    assert "side by side" in batch.engine, batch.engine
    mobilities = np.array([1 / 0.02, 3 / 0.3])
    shares = mobilities / (mobilities @ [1, 3])
    coasting = np.outer(times - 0.25, u - rate[0] * shares)
    assert np.abs(batch.q[0] - q - coasting - np.outer(asked - asked[0], shares)).max() < 1e-8
    assert np.abs(batch.u[0] - u - np.outer(rate - rate[0], shares)).max() < 1e-8


def test_what_parts_is_named() -> None:
    """At the start the drives at both ends agree, later they do not."""
    model = coupled_model(
        [wheel("a", 0.02), wheel("b", 0.3), wheel("c", 0.1)],
        [pin("A", "a", drive="t^2"), pin("B", "b"), pin("C", "c", drive="t^3")],
        {"name": "gear", "expression": "A.q + 3*B.q"},
        {"name": "belt", "expression": "B.q - C.q"},
    )
    result = _fused_model(model).simulate(1.0, "dop853")
    assert not result.success and 'coupling "belt" at t = ' in result.message


def test_derivatives() -> None:
    """By differences of accelerations, along motions that keep what is coupled."""
    scene, q, u = random_coupled(6)
    model = mstmm.compile(mstmm.Scene(**copy.deepcopy(scene)))
    found, draw = model.derivatives(q, u), np.random.default_rng(6)
    freedom = model.independent_speeds
    assert freedom is not None
    ways = freedom.motion_matrix(q, freedom.indices)
    moved, faster = ways @ draw.normal(size=ways.shape[1]), draw.normal(size=model.nu)
    rates = model.looped.rates(0.0, q, moved, model.looped.start_memory())

    def differences(size: float, d_q: float = 0, d_u: float = 0, d_t: float = 0) -> np.ndarray:
        """f' to the fourth order."""
        a, b, c, d = (
            model.accelerations(q + k * d_q * rates, u + k * d_u * faster, t=k * d_t)
            for k in (2 * size, size, -size, -2 * size)
        )
        return np.asarray((8 * (b - c) - (a - d)) / (12 * size))

    assert worst(found.q @ moved, differences(1e-4, d_q=1)) < 1e-7
    assert worst(found.u @ faster, differences(1e-3, d_u=1)) < 1e-8
    assert worst(found.t, differences(1e-3, d_t=1)) < 1e-8
    assert np.abs(found.efforts.T - model.solve(q, np.eye(model.nu))).max() < 1e-10


def test_derivatives_by_numbers_of_the_scene() -> None:
    """The moment of a planetary gear's ring, in closed form."""
    model = planetary({"sun": 1.0, "ring": 0.5})
    q, u = model.initial_state()
    found = model.derivatives(q, u, parameters=["ring.inertia[2]"]).parameters["ring.inertia[2]"]
    ratios = np.array([[1, 0], [0, 1], [0.03 / 0.1, 0.07 / 0.1]])
    inverse = np.linalg.inv(inertia(ratios))
    wanted = -inverse @ np.diag([0.0, 1.0]) @ inverse @ [1.0, 0.5]
    assert worst(found[:3], ratios @ wanted) < 1e-11
