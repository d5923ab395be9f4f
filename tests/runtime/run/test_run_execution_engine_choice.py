"""Runs choose their engine without a clock; compiled code keeps everything a run can do."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import EnvironmentFailure
from mstmm.runtime.model.model import Model
from mstmm.runtime.result.result import Result
from mstmm.runtime.run import integration_run
from tests.support.integration.compiled_systems import same_bits
from tests.support.scenes.rods import chain

LONG: dict[str, Any] = {"t_end": 12000.0, "rtol": 1e-6, "atol": 1e-8, "output_times": [12000.0]}
SHORT: dict[str, Any] = {"t_end": 2.0, "rtol": 1e-9, "atol": 1e-11}


def model(engine: str, **law: Any) -> Model:
    scene = chain(["pin", "pin"])
    if law:
        scene["hinge"][1]["law"] = law
    return mstmm.compile(mstmm.Scene.from_data(scene), engine=engine)


def equal(a: Result, b: Result) -> bool:
    return all(same_bits(getattr(a, n), getattr(b, n)) for n in ("t", "q", "u", "work", "event"))


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MSTMM_CACHE", str(tmp_path / "cache"))
    return tmp_path


@pytest.mark.usefixtures("empty_cache")
def test_a_run_compiles_where_that_pays_and_then_starts_again() -> None:
    auto = model("auto")
    short = auto.simulate(**SHORT)
    assert auto.engine == "looped"
    assert equal(short, model("looped").simulate(**SHORT))
    long = auto.simulate(**LONG)
    assert auto.engine == "fused"
    assert equal(long, model("fused").simulate(**LONG))


def test_compiled_code_says_what_failed_and_where() -> None:
    messages = []
    for engine in ("looped", "fused"):
        made = model(engine, effort="1e-3*q[0]^9")
        run = made.simulate(20.0, initial=([0.0, 9.0], [0.0, 0.0]), rtol=1e-6, atol=1e-8)
        assert not run.success
        messages.append(run.message.split(" at t")[0])
    assert messages[0] == messages[1]
    assert messages[1] == "step too small"


@pytest.mark.parametrize("method", ["dop853", "pirk13"])
def test_work_and_samples_agree_with_the_looped_engine(method: str) -> None:
    times = np.linspace(0.0, 2.0, 21)
    runs = [
        model(engine, **law).simulate(
            2.0, method=method, rtol=1e-10, atol=1e-12, output_times=times
        )
        for law in ({}, {"damping": 0.3, "stiffness": 2.0})
        for engine in ("looped", "fused")
    ]
    for looped, fused in (runs[:2], runs[2:]):
        for name in ("t", "q", "u", "work"):
            ours, theirs = getattr(fused, name), getattr(looped, name)
            assert ours == pytest.approx(theirs, abs=2e-7), name
    assert np.abs(runs[3].work).max() > 0.01


@pytest.mark.parametrize("method", ["dop853", "pirk13"])
def test_an_interrupted_run_on_compiled_code_continues_bit_for_bit(
    empty_cache: Path, heard: None, monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    monkeypatch.setattr(
        integration_run, "SLICE", 0.001
    )  # else a fast machine has done before Ctrl-C
    settings: dict[str, Any] = {
        "t_end": 1000.0, "method": method, "rtol": 1e-8, "atol": 1e-10,
        "output_times": [3.0, 400.0, 1000.0],
    }  # fmt: skip
    path, fused = empty_cache / "run.npz", model("fused")
    whole = fused.simulate(execution=mstmm.Execution(checkpoint=path), **settings)
    calls = []

    def interrupt(t: float, _: float) -> None:
        calls.append(t)
        os.kill(os.getpid(), signal.SIGINT)

    cut = fused.simulate(execution=mstmm.Execution(checkpoint=path, progress=interrupt), **settings)
    assert calls
    assert cut.status is None
    resumption = mstmm.Execution(checkpoint=path, resume=True)
    with pytest.raises(EnvironmentFailure, match="began on fused code, which cannot be compiled"):
        model("looped").simulate(execution=resumption, **settings)
    assert equal(fused.simulate(execution=resumption, **settings), whole)
