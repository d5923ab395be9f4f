"""Batches and interrupted runs of implicit methods have the bytes of single runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.steppers import IMPLICIT, get
from tests.runtime.run.test_batch_run import rod_model
from tests.runtime.run.test_checkpoint import interrupt_run
from tests.support.implicit_methods import motions
from tests.support.integration.compiled_systems import same_bits

TIMES = [0.2, 0.5]


def steps(method: str) -> dict[str, Any]:
    return {} if get(method).adaptive else {"step": 0.01}


@pytest.mark.parametrize("engine", ["looped", "fused"])
@pytest.mark.parametrize("method", IMPLICIT)
def test_a_batch_has_the_bytes_of_single_runs(method: str, engine: str) -> None:
    """Of rods on which nothing does work: a single run watches its work, a batch does not."""
    model = rod_model("ball", engine)
    rng = np.random.default_rng(3)
    q, u = model.initial_state()
    q, u = np.tile(q, (5, 1)), u + rng.normal(size=(5, model.nu))
    how = {"method": method, "output_times": TIMES, "rtol": 1e-5, "atol": 1e-7, **steps(method)}
    batch = model.simulate_batch((q, u), t_end=0.5, threads=2, **how)
    assert batch.success.all()
    for i in range(5):
        alone = model.simulate(0.5, initial=(q[i], u[i]), **how)
        assert same_bits(batch.q[i], alone.q)
        assert same_bits(batch.u[i], alone.u)


def test_a_batch_takes_numbers_of_the_scene_and_a_radius() -> None:
    scene = mstmm.Scene(**motions.double_pendulum(1e6))
    model = mstmm.compile(scene, engine="looped")
    stiffness = np.array([1e4, 1e6, 1e8])
    name = "hinge0.law.stiffness[0]"
    q, u = model.initial_state()
    starts = np.tile(q, (3, 1)), u
    how: dict[str, Any] = {"method": mstmm.methods.GeneralizedAlpha(radius=0.5), "step": 0.01}
    batch = model.simulate_batch(starts, {name: stiffness}, t_end=0.3, output_times=[0.3], **how)
    assert batch.success.all()
    for i in range(3):
        alone = model.with_parameters({name: stiffness[i]}).simulate(0.3, output_times=[0.3], **how)
        assert batch.q[i] == pytest.approx(alone.q, abs=1e-9)
    how["method"] = mstmm.methods.GeneralizedAlpha(radius=0.1)
    other = model.simulate_batch(starts, {name: stiffness}, t_end=0.3, output_times=[0.3], **how)
    assert np.abs(other.q - batch.q).max() > 1e-7


def test_a_trajectory_of_a_batch_that_fails_says_so_alone() -> None:
    model = mstmm.compile(mstmm.Scene(**motions.upright_chain(1, 0.0)), engine="looped")
    angles = np.array([[0.0], [np.pi], [0.0]])  # standing, hanging, standing
    batch = model.simulate_batch((angles, np.zeros((3, 1))), t_end=2.0, method="genalpha", step=1.0)
    assert batch.success.tolist() == [False, True, False]
    assert 'hinge "hinge0"' in batch.messages[0] and "topples" in batch.messages[0]
    assert np.isnan(batch.q[0]).all() and np.isfinite(batch.q[1]).all()


@pytest.mark.parametrize("method", ["rodas4p2", "kvaerno5", "genalpha", "houbolt"])
def test_a_run_resumed_from_a_file_has_the_bytes_of_a_whole_one(
    method: str, tmp_path: Path, heard: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = mstmm.compile(mstmm.Scene(**motions.driven_root(1e4)), engine="looped")
    path, how = tmp_path / "run.npz", steps(method)
    whole = model.simulate(1.0, method, **how)
    with monkeypatch.context() as patch:
        interrupt_run(patch, 0.4)
        cut = model.simulate(1.0, method, execution=mstmm.Execution(checkpoint=path), **how)
    assert cut.status is None and 0.4 < cut.t[-1] < 1.0
    rest = model.simulate(
        1.0, method, execution=mstmm.Execution(checkpoint=path, resume=True), **how
    )
    assert rest.success, rest.message
    for name in ("t", "q", "u", "work", "event"):
        assert getattr(whole, name).tobytes() == getattr(rest, name).tobytes(), name
    assert rest.statistics == whole.statistics
