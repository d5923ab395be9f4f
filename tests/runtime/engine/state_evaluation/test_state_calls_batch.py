"""Batches of accelerations: the same bits whatever the batch and the threads, failures by name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.engine.state_evaluation import state_calls
from tests.support.scenes.rods import chain, drawn_state

ENGINES = ("fused", "looped")
HINGES = ["pin", "ball"]


@pytest.fixture(scope="module")
def models() -> dict[str, mstmm.Model]:
    scene = mstmm.Scene(**chain(HINGES, skew=0.5))
    return {engine: mstmm.compile(scene, engine=engine) for engine in ENGINES}


def states(n: int) -> tuple[Any, Any]:
    draw = np.random.default_rng(8)
    drawn = [drawn_state(chain(HINGES, skew=0.5), draw) for _ in range(n)]
    return np.array([q for q, _ in drawn]), np.array([u for _, u in drawn])


@pytest.fixture
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Threads from a handful of states on."""
    monkeypatch.setattr(state_calls, "_MIN_WORK_LANES", 16)
    monkeypatch.setattr(state_calls, "_MIN_WORK_LOOPED", 8)


@pytest.mark.parametrize("engine", ENGINES)
def test_bits_depend_on_neither_batch_nor_threads(
    engine: str, models: dict[str, mstmm.Model], small_pieces: None
) -> None:
    model = models[engine]
    q, u = states(45)
    whole = model.accelerations(q, u, threads=1)
    for threads in (2, 3, 7, None):
        assert model.accelerations(q, u, threads=threads).tobytes() == whole.tobytes()
    for first, end in ((0, 1), (3, 4), (0, 8), (5, 14), (44, 45)):
        part = model.accelerations(q[first:end], u[first:end])
        assert part.tobytes() == whole[first:end].tobytes()
    turned = model.accelerations(q[::-1], u[::-1])
    assert turned.tobytes() == whole[::-1].tobytes()


def test_engines_and_single_states_agree(models: dict[str, mstmm.Model]) -> None:
    q, u = states(20)
    fused, looped = (models[engine].accelerations(q, u) for engine in ENGINES)
    size = np.abs(looped).max(axis=1, keepdims=True)
    assert (np.abs(fused - looped) / size).max() < 1e-13
    for k in (0, 19):
        for engine in ENGINES:
            one = models[engine].accelerations(q[k], u[k])
            assert one.shape == (models[engine].nu,)
            assert np.abs(one - looped[k]).max() / size[k] < 1e-13


@pytest.mark.parametrize("engine", ENGINES)
def test_leading_axes_times_and_efforts(engine: str, models: dict[str, mstmm.Model]) -> None:
    model = models[engine]
    q, u = states(6)
    flat = model.accelerations(q, u)
    grid = model.accelerations(q.reshape(2, 3, -1), u.reshape(2, 3, -1))
    assert grid.shape == (2, 3, model.nu)
    assert grid.tobytes() == flat.tobytes()
    assert model.accelerations(q[:0], u[:0]).shape == (0, model.nu)
    spread = model.accelerations(q[0], u[0], t=np.zeros(4))
    assert spread.shape == (4, model.nu)
    assert spread[3].tobytes() == flat[0].tobytes()
    efforts = np.zeros_like(u)
    efforts[2, 0] = 3.0
    pushed = model.accelerations(q, u, efforts=efforts)
    assert [bool((a == b).all()) for a, b in zip(pushed, flat, strict=True)] == [
        True, True, False, True, True, True,
    ]  # fmt: skip


@pytest.mark.parametrize("engine", ENGINES)
def test_drives_and_loads_see_each_state_s_time(engine: str) -> None:
    data = chain(["pin", "pin"])
    data["hinge"][0]["drive"] = "0.5*sin(3*t)"
    data["load"] = [{"on": "rod1.tip", "force": [0, "10*cos(t)", 0]}]
    model = mstmm.compile(mstmm.Scene(**data), engine=engine)
    t = np.linspace(0.0, 2.0, 11)
    q, u = np.tile([0.0, 0.4], (11, 1)), np.tile([0.0, -1.0], (11, 1))
    found = model.accelerations(q, u, t)
    assert np.abs(found[:, 0] + 4.5 * np.sin(3 * t)).max() < 1e-14
    for k in range(11):
        one = model.accelerations(q[k], u[k], t[k])
        assert np.abs(found[k] - one).max() <= 1e-13 * np.abs(one).max()


@pytest.mark.parametrize("engine", ENGINES)
def test_failures_name_state_and_element(engine: str, small_pieces: None) -> None:
    """The ends of a spring meet in states 30 and 37: the first of them is told."""
    data = chain(["prismatic"])
    data["hinge"][0]["axis"] = [1.0, 0.0, 0.0]
    cord = {"name": "cord", "from": "ground", "to": "rod0.tip"}
    data["spring"] = [{**cord, "law": {"stiffness": 5.0, "rest": 1.0}}]
    model = mstmm.compile(mstmm.Scene(**data), engine=engine)
    q, u = np.full((50, 1), 0.3), np.zeros((50, 1))
    assert np.isfinite(model.accelerations(q, u)).all()
    q[30] = q[37] = -1.0
    for threads in (1, 3):
        with pytest.raises(NumericalFailure, match=r'^state 30: spring "cord" .* ends coincide'):
            model.accelerations(q, u, threads=threads)
    with pytest.raises(NumericalFailure, match=r'^state \[6, 0\]: spring "cord"'):
        model.accelerations(q.reshape(10, 5, 1), u.reshape(10, 5, 1))
    with pytest.raises(NumericalFailure, match=r'^spring "cord"'):
        model.accelerations(q[37], u[37])


@pytest.mark.parametrize("threads", [0, -2, 1.5, "2"])
def test_impossible_threads(threads: Any, models: dict[str, mstmm.Model]) -> None:
    q, u = states(2)
    with pytest.raises(SceneError, match=r"threads = .*whole number"):
        models["looped"].accelerations(q, u, threads=threads)
