"""One state at a time: the same numbers as among others, and the same refusals."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm import NumericalFailure, SceneError
from mstmm.runtime.engine.state_evaluation.state_calls import MAX_SIZE, SingleStateCalls
from mstmm.runtime.kernels.prepared_calls import prepare_call

ROD: dict[str, Any] = {
    "mass": 1.2, "center_of_mass": [0.5, 0.1, 0], "inertia": [0.02, 0.08, 0.09, 0.002, 0, 0.001],
    "ends": {"tip": [1, 0, 0]},
}  # fmt: skip
SCENE: dict[str, Any] = {
    "gravity": [0.2, -9.81, 0.1],
    "input": [{"name": "wind", "unit": "N", "value": "gust"}],
    "signal": [{"name": "gust", "unit": "N", "times": [0, 1, 2], "values": [1, 3, -2]}],
    "body": [ROD | {"name": name} for name in ("a", "b", "c", "d")],
    "hinge": [
        {"name": "one", "type": "ball", "inboard": "ground", "outboard": "a"},
        {"name": "two", "type": "pin", "inboard": "a.tip", "outboard": "b", "axis": [0, 1, 0],
         "law": {"inertia": 0.3, "damping": 0.1}},
        {"name": "three", "type": "cylindrical", "inboard": "a.tip", "outboard": "c"},
        {"name": "four", "type": "pin", "inboard": "b.tip", "outboard": "d", "drive": "0.3*t^2"},
    ],
    "load": [{"on": "c.tip", "force": ["wind", 0, 0]}],
}  # fmt: skip


@cache
def model(engine: str) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**SCENE), engine=engine)


def state(seed: int) -> tuple[Any, ...]:
    """q, u, efforts and accelerations."""
    rng = np.random.default_rng(seed)
    one = model("looped")
    q = rng.uniform(-1, 1, one.nq)
    q[:4] /= np.linalg.norm(q[:4])
    return (q, *(rng.uniform(-1, 1, one.nu) for _ in range(3)))


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_a_state_alone_has_the_numbers_it_has_among_others(engine: str) -> None:
    one, (q, u, push, asked) = model(engine), state(1)
    for t in (0.0, 0.5, 1.7):
        alone = one.accelerations(q, u, t), one.accelerations(q, u, t, push)
        looped = engine == "looped"
        for found, efforts in zip(alone, (None, push), strict=True):
            many = one.accelerations(q[None], u[None], t, efforts)[0]
            assert found == pytest.approx(many, rel=0 if looped else 1e-12, abs=0)
        many = one.inverse_dynamics(q[None], u[None], asked, t)[0]
        assert np.array_equal(one.inverse_dynamics(q, u, asked, t), many)
    assert np.array_equal(one.mass_matrix(q), one.mass_matrix(q[None])[0])


def test_points_and_sums_alone_are_those_among_others() -> None:
    """A call of its own for one state, and arrays for several: two ways to the same numbers."""
    one, (q, u, *_) = model("looped"), state(5)
    for of in ("d.tip", ["d.tip", "a", "ground"]):
        asked: tuple[tuple[Any, ...], ...] = (
            (one.positions, q), (one.poses, q), (one.velocities, q, u), (one.jacobian, q),
            (one.jacobian_rate, q, u),
        )  # fmt: skip
        for call, *at in asked:
            found, many = call(*at, of), call(*(row[None] for row in at), of)[0]
            assert found.shape == many.shape
            assert np.allclose(found, many, rtol=1e-12, atol=1e-14), (call, of)
        general, rate = one._kinematics.jacobian(of, q), one._jacobian_rate(of, q, u)
        for alone, found in ((one.jacobian(q, of), general), (one.jacobian_rate(q, u, of), rate)):
            assert np.allclose(alone, found.reshape(alone.shape), rtol=1e-12, atol=1e-14), of
    for call, *at in ((one.energy, q, u, 0.7), (one.momentum, q, u, 0.7)):
        found, many = call(*at), call(q[None], u[None], 0.7)[0]
        assert found.shape == many.shape and np.array_equal(found, many), call
    turned = 3.0 * q  # quaternions of any length
    assert np.allclose(
        one.integrate(turned, u, 0.2), one.integrate([turned], u, 0.2)[0], rtol=1e-14
    )


def test_jacobians_of_several_states_are_those_of_each() -> None:
    one, (q, u, *_) = model("looped"), state(7)
    states, speeds = q * np.array([[[1.0]], [[2.0]], [[-1.0]]]), u + np.arange(2.0)[:, None]
    for of in ("d.tip", ["d.tip", "a", "ground"]):
        found, rates = one.jacobian(states, of), one.jacobian_rate(states, speeds, of)
        assert rates.shape == (3, 2, *one.jacobian(q, of).shape)
        for at in np.ndindex(3, 2):
            assert np.array_equal(found[at[0], 0], one.jacobian(states[at[0], 0], of))
            each = one.jacobian_rate(states[at[0], 0], speeds[at[1]], of)
            assert np.array_equal(rates[at], each)
        assert one.jacobian(states[:0, 0], of).shape == (0, *one.jacobian(q, of).shape)
        nowhere = one.jacobian_rate(states[:0, 0], speeds[:0], of)
        assert nowhere.shape == (0, *one.jacobian(q, of).shape)


def test_large_scenes_let_other_threads_run() -> None:
    rods = [ROD | {"name": f"r{k}"} for k in range(MAX_SIZE + 1)]
    pins = [
        {"name": f"h{k}", "type": "pin", "inboard": f"r{k - 1}.tip" if k else "ground",
         "outboard": f"r{k}", "axis": [k % 2, 1 - k % 2, 0]}
        for k in range(MAX_SIZE + 1)
    ]  # fmt: skip
    scene = mstmm.Scene(gravity=[0, 0, -9.81], body=rods, hinge=pins)
    one, rng = mstmm.compile(scene, engine="looped"), np.random.default_rng(6)
    q, u = rng.uniform(-0.1, 0.1, (2, one.nu))
    with ThreadPoolExecutor(2) as pool:
        alone = list(pool.map(lambda _: one.accelerations(q, u), range(4)))
    assert all(np.array_equal(found, one.accelerations(q[None], u)[0]) for found in alone)
    asked = np.ones(one.nu)
    assert np.array_equal(one.inverse_dynamics(q, u, asked), one.inverse_dynamics([q], u, asked)[0])
    assert np.array_equal(one.jacobian(q, "r9"), one.jacobian(q[None], "r9")[0])
    for found in (one.jacobian(q[None][:0], "r9"), one.jacobian_rate(q[None][:0], u, "r9")):
        assert found.shape == (0, 6, one.nu)


def test_the_mass_matrix_gives_what_inverse_dynamics_asks() -> None:
    one, (q, _, _, asked) = model("looped"), state(2)
    still, driven = np.zeros(one.nu), one.coordinate_layout.hinges["four"]
    q[driven.q] = asked[driven.u] = 0.0  # where its drive has it
    apart = one.inverse_dynamics(q, still, asked) - one.inverse_dynamics(q, still, still)
    free = [k for k in range(one.nu) if k != driven.u]
    assert (one.mass_matrix(q) @ asked)[free] == pytest.approx(apart[free], rel=1e-12)


def test_states_in_other_forms_go_the_general_way() -> None:
    one, (q, u, push, asked) = model("fused"), state(3)
    wanted = one.accelerations(q, u, 0.0, push)
    spread = np.zeros((len(q), 2))
    spread[:, 0] = q
    for other in (list(q), spread[:, 0], q.astype(np.longdouble)):
        assert np.allclose(one.accelerations(other, list(u), 0, tuple(push)), wanted, rtol=1e-14)
    assert np.allclose(one.mass_matrix(list(q)), one.mass_matrix(q), rtol=0, atol=0)
    assert np.allclose(one.inverse_dynamics(list(q), u, asked), one.inverse_dynamics(q, u, asked))


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_what_is_wrong_is_said_as_ever(engine: str) -> None:
    one, (q, u, _, asked) = model(engine), state(4)
    spoilt = u.copy()
    spoilt[2] = np.nan
    with pytest.raises(SceneError, match=r"u\[2\] = nan: expected a finite number"):
        one.accelerations(q, spoilt)
    with pytest.raises(SceneError, match=r"q\[0\] = nan"):
        one.mass_matrix(q * np.nan)
    with pytest.raises(SceneError, match=r"udot has shape \(2,\)"):
        one.inverse_dynamics(q, u, asked[:2])
    huge = np.full_like(u, 1e200)
    with pytest.raises(NumericalFailure, match="is not finite"):
        one.accelerations(q, huge)


def test_threads_do_not_meet() -> None:
    one = model("fused")
    states = [state(k) for k in range(40)]
    alone = [one.accelerations(q, u) for q, u, *_ in states]

    def matches_serial_result(k: int) -> bool:
        q, u, *_ = states[k % 40]
        return np.array_equal(one.accelerations(q, u), alone[k % 40])

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(matches_serial_result, range(400)))


def alone() -> SingleStateCalls:
    return model("looped")._single_state


def test_it_takes_rows_of_doubles_and_nothing_else() -> None:
    calls, (q, u, push, _) = alone(), state(1)
    assert calls.accelerations(0.0, q, u, None).shape == push.shape
    read_only = q.copy()
    read_only.flags.writeable = False
    assert calls.mass(read_only) is not None
    odd = np.zeros(8 * len(q) + 1, dtype=np.uint8)[1:].view(np.float64)  # not aligned
    others: tuple[Any, ...] = (
        q[:-1], q[None], q.tolist(), q.astype(np.float32), q.astype(">f8"), np.ma.array(q),
        np.repeat(q, 2)[::2], odd, None, 1.0,
    )  # fmt: skip
    for other in others:
        assert calls.mass(other) is None, other
    assert calls.accelerations(0, q, u, None) is None  # no float
    assert calls.efforts(0.0, q, u, None) is None  # not optional
    assert calls.accelerations(float("nan"), q, u, None) is None


def test_it_counts_what_it_is_given() -> None:
    with pytest.raises(TypeError, match="expected 1 arguments"):
        alone().mass()
    with pytest.raises(TypeError, match="expected 4 arguments"):
        alone().accelerations(0.0, np.zeros(3))


@pytest.mark.parametrize(
    ("widths", "shapes", "said"),
    [([1] * 5, [()], "at most 4"), ([1], [], "1 to 8"), ([1], [(1, 1, 1, 1)], "at most 3")],
)
def test_it_has_bounds(widths: list[int], shapes: list[tuple[int, ...]], said: str) -> None:
    record = model("looped").looped.ffi.new("mstmm_alone *")
    with pytest.raises(ValueError, match=said):
        prepare_call("mstmm_alone_mass", record, widths, *shapes)


def test_answers_are_arrays_of_their_own() -> None:
    calls, (q, *_) = alone(), state(2)
    first = calls.mass(q)
    kept = first.copy()
    calls.mass(q + 1.0)
    assert np.array_equal(first, kept) and first.flags.owndata
