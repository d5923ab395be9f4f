"""method = "auto": an explicit run where that serves, another method where stability sets steps."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from benchmarks.stiff import references, scenes
from benchmarks.stiff.cases import CASES
from mstmm.runtime.integrate.c_loop import Integrator
from mstmm.runtime.integrate.steppers import get, register
from mstmm.runtime.model.model import Model
from mstmm.runtime.result.result import Result
from mstmm.runtime.run import run_execution
from mstmm.runtime.run.scene_system import SceneSystem
from tests.support.integration.compiled_systems import same_bits
from tests.support.scenes.results import pins

LOOSE: dict[str, Any] = {"rtol": 1e-4, "atol": 1e-6}
ARRAYS = ("t", "q", "u", "work", "event")


def compile_looped(scene: dict[str, Any] | mstmm.Scene) -> Model:
    made = scene if isinstance(scene, mstmm.Scene) else mstmm.Scene(**scene)
    return mstmm.compile(made, engine="looped")


def equal(a: Result, b: Result) -> bool:
    return all(same_bits(getattr(a, name), getattr(b, name)) for name in ARRAYS)


def work(result: Result) -> int:
    """Passes over the bodies of a run, of whatever kind."""
    s = result.statistics
    assert s is not None
    return s.evaluations + s.residuals + s.tangents + s.solves


def names(result: Result) -> list[str]:
    return [stretch.method for stretch in result.method_history]


def pressed_slider() -> dict[str, Any]:
    """A slider of 1 kg that is pressed to a stop and pulled from it, once a second."""
    limits = {"lower": 0.0, "stiffness": 1e8, "damping": 2e4}
    hinge = {
        "name": "slide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
        "outboard": "block", "initial": {"q": [0.01]},
        "law": {"effort": "-20*sin(2*pi*t)", "stiffness": 40.0, "damping": 5.0,
                "limits": limits},
    }  # fmt: skip
    block = {"name": "block", "mass": 1.0, "inertia": [1, 1, 1]}
    return {"gravity": [0, 0, 0], "body": [block], "hinge": [hinge]}


def eventful() -> dict[str, Any]:
    """Rods on stiff bushings: a force that jumps, a hinge that is let go, a stop of the run."""
    scene = scenes.bushed_rods(3, 1e8, 0.1)
    scene["hinge"].append({"name": "brake", "type": "pin", "inboard": "rod2.tip",
                           "outboard": "wheel", "drive": "0", "release": "t >= 0.3"})  # fmt: skip
    scene["body"].append({"name": "wheel", "mass": 0.5, "inertia": [0.1, 0.1, 0.1],
                          "center_of_mass": [0.1, 0, 0]})  # fmt: skip
    scene["load"] = [{"on": "rod0.tip", "force": ["where(t < 0.2, 30, 0)", 0, 0]}]
    scene["event"] = [{"name": "down", "when": "hinge0.q[2] <= -1.3", "do": "stop"}]
    return scene


@pytest.mark.parametrize("engine", ["looped", "fused"])
@pytest.mark.parametrize("options", [{}, LOOSE, {"output_times": [0.5, 1.0]}])
def test_a_run_that_is_not_stiff_is_that_of_dop853(engine: str, options: dict[str, Any]) -> None:
    model = mstmm.compile(pins(3, [0.3, -0.4, 1.0], damping=0.1), engine=engine)
    auto, plain = (model.simulate(2.0, method=name, **options) for name in ("auto", "dop853"))
    assert equal(auto, plain) and auto.statistics == plain.statistics
    assert names(auto) == ["dop853"] and plain.method_history == ()
    assert auto.method_history[0].fastest_rate is None


@pytest.mark.parametrize("name", ["a10-1e4", "e"])
def test_scenes_that_are_not_stiff_enough(name: str) -> None:
    model = compile_looped(CASES[name].scene())
    auto, plain = (model.simulate(1.0, method=method, **LOOSE) for method in ("auto", "dop853"))
    assert equal(auto, plain) and names(auto) == ["dop853"]


def test_an_engine_compiled_on_the_way_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run starts again on compiled code, and so does its choice."""
    monkeypatch.setenv("MSTMM_CACHE", str(tmp_path / "cache"))
    scene = mstmm.Scene(**scenes.bushed_rods(2, 1e4, 0.3))
    options: dict[str, Any] = {"method": "auto", "rtol": 1e-9, "output_times": [400.0]}
    auto = mstmm.compile(scene, engine="auto")
    long = auto.simulate(400.0, **options)
    assert auto.engine == "fused"
    fused = mstmm.compile(scene, engine="fused").simulate(400.0, **options)
    assert equal(long, fused) and long.method_history == fused.method_history


def test_stiff_rods_take_a_tenth_of_the_work() -> None:
    case = CASES["a10-1e8"]
    model, (expected, _) = compile_looped(case.scene()), references.load_reference(case)
    auto, plain = (
        model.simulate(case.t_end, method=method, **LOOSE) for method in ("auto", "dop853")
    )
    assert names(auto) == ["dop853", "rodas4p2"]
    error = np.linalg.norm(references.end_positions(auto, case) - expected, axis=1).max()
    assert error < 1e-4
    assert work(auto) < work(plain) / 10
    change = auto.method_history[1]
    assert 0.0 < change.t < 0.1 and change.fastest_rate == pytest.approx(34375.0, rel=0.1)
    assert "stability" in change.reason and "rodas4p2 from t = 0.0" in str(change)
    tight = model.simulate(0.1, method="auto", rtol=1e-7, atol=1e-9)
    assert names(tight) == ["dop853", "rodas5p"]


def test_contact_on_and_off_changes_the_method_both_ways() -> None:
    model = compile_looped(pressed_slider())
    run = model.simulate(3.0, method="auto", rtol=1e-5, atol=1e-9)
    exact = model.simulate(3.0, rtol=1e-10, atol=1e-13)
    assert run.success and names(run) == ["dop853", *["rodas4p2", "dop853"] * 3]
    assert work(run) < work(exact) / 5
    touching = [run.q[np.searchsorted(run.t, change.t), 0] < 0 for change in run.method_history]
    assert touching == [False, *[True, False] * 3]
    rates = [change.fastest_rate for change in run.method_history[1:3]]
    assert rates == pytest.approx([1e4, np.sqrt(40)], rel=0.05)
    assert run.q[-1] == pytest.approx(exact.q[-1], abs=1e-4)
    assert run.certificate.energy.relative < 1e-3


def test_events_breaks_and_releases_go_on_across_a_change() -> None:
    model = compile_looped(eventful())
    run = model.simulate(2.0, method="auto", rtol=1e-6, atol=1e-8)
    exact = model.simulate(2.0, rtol=1e-8, atol=1e-10)
    assert names(run) == ["dop853", "rodas5p"] and run.method_history[1].t < 0.2
    assert run.message.startswith('stopped by event "down"')
    assert run.t[-1] == pytest.approx(exact.t[-1], abs=1e-5)
    assert {0.2, 0.3} <= set(run.t.tolist())
    assert set(run.trajectory.memory[:, 0]) == {0.0, 1.0}
    assert run.certificate.energy.relative < 1e-4
    assert run.statistics is not None and run.statistics.events == 2


def test_slices_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    model = compile_looped(eventful())
    options: dict[str, Any] = {"method": "auto", "rtol": 1e-6}
    whole = model.simulate(2.0, **options)
    monkeypatch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)
    cut = model.simulate(2.0, **options)
    assert equal(cut, whole) and cut.method_history == whole.method_history
    assert cut.statistics == whole.statistics


@pytest.mark.parametrize("at", [0.001, 0.05, 0.35])
def test_an_interrupted_run_goes_on_bit_for_bit(
    tmp_path: Path, heard: None, monkeypatch: pytest.MonkeyPatch, at: float
) -> None:
    """Interrupted before the change and after it; events and a release lie behind."""

    def report_and_save(self: run_execution.RunMonitor, run: Integrator, earlier: object) -> None:
        if run.t > at:
            signal.raise_signal(signal.SIGINT)

    model, path = compile_looped(eventful()), tmp_path / "run.npz"
    options: dict[str, Any] = {"method": "auto", "rtol": 1e-6}
    whole = model.simulate(2.0, **options)
    with monkeypatch.context() as patch:
        patch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)
        patch.setattr(run_execution.RunMonitor, "report_and_save", report_and_save)
        part = model.simulate(2.0, execution=mstmm.Execution(checkpoint=path), **options)
    assert part.status is None and (len(part.method_history) == 1) == (at == 0.001)
    rest = model.simulate(2.0, execution=mstmm.Execution(checkpoint=path, resume=True), **options)
    assert equal(rest, whole) and rest.method_history == whole.method_history
    assert rest.statistics == whole.statistics


@pytest.mark.parametrize("methods", [
    "", "[]", "{}", '{"stretches": [], "asked_for": [5, 0, 0], "since": 0}',
    '{"stretches": [{"t": 0, "method": "rk4", "rate": null, "why": ""}], "asked_for": [5, 0, 0],'
    ' "since": 0}',
    '{"stretches": [{"t": "?", "method": "dop853", "rate": null, "why": ""}],'
    ' "asked_for": [5, 0, 0], "since": 0}',
    '{"stretches": [{"t": 0, "method": "rodas4p2", "rate": 1, "why": ""}],'
    ' "asked_for": [5, 0, 0], "since": 0}',
])  # fmt: skip
def test_an_edited_checkpoint_is_refused(tmp_path: Path, methods: str) -> None:
    model, path = compile_looped(pins(1, [0.3])), tmp_path / "run.npz"
    model.simulate(1.0, method="auto", execution=mstmm.Execution(checkpoint=path))
    with np.load(path) as file:
        data = {key: file[key] for key in file.files}
    np.savez(path, **data | {"methods": np.array(methods)})
    with pytest.raises(mstmm.SceneError, match="damaged"):
        model.simulate(1.0, method="auto", execution=mstmm.Execution(checkpoint=path, resume=True))


def test_where_implicit_steps_fail_the_run_goes_on_explicitly(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A tangent that is singular from 0.02 s on costs a change, not the run."""
    offer, kept = SceneSystem.offer_tangent, list[Any]()

    def offer_failing_tangent(system: SceneSystem) -> None:
        offer(system)
        ffi, given = system.engine.ffi, system.system.implicit
        failing = ffi.new("mstmm_implicit *", given[0])

        def tangent(context: Any, t: float, *rest: Any) -> int:
            return 1 if t > 0.02 else int(given.tangent(context, t, *rest))

        called = ffi.callback(ffi.typeof(failing.tangent), tangent)
        failing.tangent, system.system.implicit = called, failing
        kept.append((failing, called))

    monkeypatch.setattr(SceneSystem, "offer_tangent", offer_failing_tangent)
    model = compile_looped(scenes.bushed_rods(2, 1e8, 0.1))
    run = model.simulate(0.1, method="auto", **LOOSE)
    assert run.success and names(run) == ["dop853", "rodas4p2", "dop853"]
    assert (
        run.method_history[2].reason == "rodas4p2 found no step"
        and 0.02 < run.method_history[2].t < 0.1
    )
    exact = model.simulate(0.1, rtol=1e-8, atol=1e-10)
    assert run.q[-1] == pytest.approx(exact.q[-1], abs=1e-5)


def test_scenes_without_implicit_methods_stay_explicit(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse_tangent(*_: object) -> None:
        raise mstmm.SceneError('hinge "cam" has no derivatives')

    model = compile_looped(CASES["f"].scene())
    plain = model.simulate(0.03, **LOOSE)
    monkeypatch.setattr("mstmm.runtime.run.spectral_radius.TangentMatrix", refuse_tangent)
    run = model.simulate(0.03, method="auto", **LOOSE)
    assert equal(run, plain) and names(run) == ["dop853", "dop853"]
    assert run.method_history[1].reason == 'no implicit method: hinge "cam" has no derivatives'


def test_trajectories_of_a_batch_choose_for_themselves() -> None:
    model = compile_looped(pressed_slider())
    q, u = np.array([[0.01], [3.0], [0.02]]), np.zeros((3, 1))
    options: dict[str, Any] = {"method": "auto", "rtol": 1e-5, "atol": 1e-9}
    batch = model.simulate_batch((q, u), t_end=0.4, threads=2, **options)
    alone = [
        model.simulate(0.4, initial=(q[i], u[i]), output_times=[0.4], **options) for i in range(3)
    ]
    assert batch.success.all() and "one after the other" in batch.engine
    assert [names(run)[-1] for run in alone] == ["rodas4p2", "dop853", "rodas4p2"]
    for i, run in enumerate(alone):
        assert batch.q[i] == pytest.approx(run.q, abs=1e-4)
        one = model.simulate_batch((q[i : i + 1], u[:1]), t_end=0.4, **options)
        assert same_bits(one.q, batch.q[i : i + 1])
        assert one.methods == batch.methods[i : i + 1]
        assert [stretch.method for stretch in batch.methods[i]] == names(run)
        assert [stretch.reason for stretch in batch.methods[i]] == [
            s.reason for s in run.method_history
        ]
    plain = model.simulate_batch((q, u), t_end=0.01)
    assert plain.methods == ((), (), ())


def test_what_it_did_is_saved_with_the_result(tmp_path: Path) -> None:
    model = compile_looped(CASES["a10-1e8"].scene())
    run = model.simulate(0.2, method="auto", **LOOSE)
    assert len(run.method_history) == 2
    loaded = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert loaded.method_history == run.method_history and loaded.settings.method == "auto"
    kept = json.loads(run.to_xarray().attrs["methods"])
    assert [row["method"] for row in kept] == names(run)


def test_its_error_is_estimated_as_that_of_any_method() -> None:
    run = compile_looped(CASES["a10-1e8"].scene()).simulate(
        0.3, method="auto", certify=True, **LOOSE
    )
    error = run.certificate.error
    assert error is not None and 0.0 < error.largest("q")["m"] < 1e-3


def test_what_makes_no_sense_with_it_is_refused() -> None:
    model = compile_looped(pins(1, [0.3]))
    state = model.initial_state()
    with pytest.raises(mstmm.SceneError, match=r'step = 0\.01: method "auto" chooses its steps'):
        model.simulate(1.0, method="auto", step=0.01)
    with pytest.raises(mstmm.SceneError, match="chooses its steps"):
        model.simulate_batch(state, t_end=1.0, method="auto", step=0.01)
    with pytest.raises(mstmm.SceneError, match='method "auto" has no such parameter'):
        model.simulate(1.0, method=mstmm.methods.GeneralizedAlpha("auto", radius=0.5))
    with pytest.raises(mstmm.SceneError, match="available are: auto, rk4"):
        model.simulate(1.0, method="automatic")
    with pytest.raises(ValueError, match="'auto' exists already"):
        import dataclasses

        register(dataclasses.replace(get("dop853"), name="auto"))


def test_a_run_without_a_method_is_changed_where_it_is_stiff() -> None:
    """A damper of 1e6 N m s/rad in the second joint: 1e7 1/s and more, millions of explicit steps;
    the stiff joint then holds two rods as one."""
    scene = pins(2, [0.3, 0.0]).model_dump(by_alias=True, exclude_none=True)
    scene["hinge"][1]["law"] = {"damping": [1e6]}
    run = compile_looped(scene).simulate(2.0)
    assert run.success and run.settings.method == "auto" and len(names(run)) > 1
    assert run.statistics is not None and run.statistics.steps < 5000
    assert np.abs(run.q[:, 1]).max() < 1e-4


@pytest.mark.parametrize("options", [{}, {"certify": True}, {"output_times": [0.5, 1.0]}])
def test_a_run_without_a_method_that_is_not_stiff_is_one_by_dop853(options: dict[str, Any]) -> None:
    model = compile_looped(pins(2, [1.0, 0.5]))
    run, named = model.simulate(1.0, **options), model.simulate(1.0, "dop853", **options)
    assert equal(run, named) and run.settings == named.settings and run.method_history == ()
    assert run.statistics == named.statistics and run.warnings == named.warnings


def test_fixed_steps_without_a_method_are_those_of_dop853() -> None:
    run = compile_looped(pins(1, [1.0])).simulate(1.0, step=0.01)
    assert run.settings.method == "dop853"


def test_a_run_without_a_method_is_resumed(tmp_path: Path) -> None:
    model, path = compile_looped(pressed_slider()), tmp_path / "run.checkpoint"
    whole = model.simulate(2.0, **LOOSE)

    def stop(t: float, _: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        model.simulate(2.0, **LOOSE, execution=mstmm.Execution(progress=stop, checkpoint=path))
    again = model.simulate(2.0, **LOOSE, execution=mstmm.Execution(checkpoint=path, resume=True))
    assert equal(again, whole) and again.method_history == whole.method_history
