"""Implicit runs by the slopes of laws alone: their order, what they agree with, what they count."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from benchmarks.stiff import scenes
from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Integrator, Samples, Statistics, Status
from mstmm.runtime.integrate.settings import Settings, validate
from mstmm.runtime.integrate.steppers import EXPLICIT, IMPLICIT, ITERATED_METHODS, W_METHODS, get
from mstmm.runtime.run.integration_run import make_run
from mstmm.runtime.run.scene_system import SceneSystem
from tests.support.implicit_methods import motions
from tests.support.models import compile_scene, looped_model
from tests.support.scenes.results import rod

Scene = dict[str, Any]


def mixed_laws_scene() -> Scene:
    """A ball and a bushing with laws, a driven pin, and a spring that laws alone do not see."""
    spread = [0.01, 0.02, 0.03]
    hinges = [
        {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "rod0",
         "drive": "0.5*sin(3*t)"},
        {"name": "ball", "type": "ball", "inboard": "rod0.tip", "outboard": "rod1",
         "axis": [1, 0, 0], "initial": {"u": [1.0, 0.1, 0.2]},
         "law": {"stiffness": spread, "damping": spread}},
        {"name": "bushing", "type": "planar", "inboard": "rod1.tip", "outboard": "rod2",
         "axis": [0, 0, 1], "axis2": [1, 0, 0],
         "law": {"stiffness": [1e3, 1e3, 1.0], "damping": [1.0, 1.0, 0.1]}},
    ]  # fmt: skip
    springs = [{"name": "far", "from": "ground", "to": "rod2.tip", "position": [1.0, -1.0, 0.5],
                "law": {"stiffness": 5.0, "rest": 0.5}}]  # fmt: skip
    bodies = [rod(f"rod{i}") for i in range(3)]
    return {
        "gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges, "spring": springs,
    }  # fmt: skip


ORDERS: dict[str, Scene] = {
    "planar": motions.double_pendulum(), "spatial": motions.spatial_rods(),
    "everything": mixed_laws_scene(),
}  # fmt: skip


@pytest.mark.parametrize("name", ORDERS)
@pytest.mark.parametrize("method", W_METHODS)
def test_methods_that_allow_it_keep_their_order(method: str, name: str) -> None:
    model = looped_model(ORDERS[name])
    exact = model.simulate(0.5, rtol=1e-13, atol=1e-14, output_times=[0.5]).q
    errors = []
    for count in (32, 128):
        run = model.simulate(
            0.5, mstmm.methods.Implicit(method, tangent="laws"), 0.5 / count, output_times=[0.5]
        )
        assert run.success, run.message
        assert run.statistics is not None
        assert run.statistics.approximate_tangents == run.statistics.tangents == count
        errors.append(float(np.abs(run.q - exact).max()))
    assert np.log2(errors[0] / errors[1]) / 2 > get(method).order - 0.25, errors


def run_with_statistics(
    model: mstmm.Model, method: str, tangent: str = "auto", **how: Any
) -> tuple[Any, Statistics]:
    chosen = mstmm.methods.Implicit(method, tangent=tangent)
    run = model.simulate(0.4, chosen, output_times=[0.2, 0.4], **how)
    assert run.success, run.message
    assert run.statistics is not None
    return run.q, run.statistics


@pytest.mark.parametrize("method", ITERATED_METHODS)
def test_iterations_agree_whatever_tangent_they_take(method: str) -> None:
    model = looped_model(mixed_laws_scene())
    how: dict[str, Any] = {"rtol": 1e-7, "atol": 1e-9}
    if not get(method).adaptive:
        how = {"step": 2e-3, "rtol": 1e-9, "atol": 1e-11}  # which bounds what iterations leave
    exact, without = run_with_statistics(model, method, tangent="exact", **how)
    assert without.approximate_tangents == 0
    for tangent in ("auto", "laws"):
        found, statistics = run_with_statistics(model, method, tangent=tangent, **how)
        assert statistics.approximate_tangents > 0.9 * statistics.tangents > 0
        # within some tolerances in between the estimates of both runs end their steps
        assert found == pytest.approx(exact, abs=1e-5 if "rtol" in how else 1e-6)


def test_where_laws_do_not_contract_exact_tangents_follow() -> None:
    """A row of rods of which one is spun: what pulls at the others is no law (h w is about 1)."""
    scene = scenes.bushed_rods(6, 1e8, 1.0)
    model = looped_model(scene)
    u = np.zeros(model.nu)
    u[2] = 40.0  # rad/s of the first rod, which takes the others along
    q, _ = model.initial_state()

    def run(tangent: str) -> Statistics:
        found = model.simulate(
            0.3,
            mstmm.methods.GeneralizedAlpha("genalpha", tangent=tangent),
            0.02,
            initial=(q, u),
            output_times=[0.3],
        )
        assert found.success, found.message
        assert found.statistics is not None
        return found.statistics

    chosen, exact = run("auto"), run("exact")
    assert 0 < chosen.approximate_tangents < chosen.tangents
    assert chosen.iterations < 1.5 * exact.iterations


def test_an_iteration_by_laws_is_a_residual_and_a_solution() -> None:
    """A mass on a spring, for which the tangent by laws is exact: one serves the whole run, and the
    second iteration of a step finds that the first has left nothing."""
    law = {"stiffness": 1e4, "damping": 10.0}
    hinge = {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "mass", "law": law, "initial": {"q": [0.1]}}  # fmt: skip
    body = {"name": "mass", "mass": 1.0}
    model = looped_model({"gravity": [0, 0, 0], "body": [body], "hinge": [hinge]})
    steps = 100
    for tangent in ("exact", "laws"):
        run = model.simulate(
            0.5,
            mstmm.methods.GeneralizedAlpha("genalpha", tangent=tangent),
            0.5 / steps,
            output_times=[0.5],
        )
        counts = run.statistics
        assert counts is not None
        assert counts.tangents == 1
        assert counts.approximate_tangents == (tangent == "laws")
        assert counts.iterations == counts.solves == 2 * steps
        assert counts.residuals == counts.solves + 2 * steps  # the power amid a step and at its end


@pytest.mark.parametrize(
    ("method", "how"),
    [("ros34pw2", {"rtol": 1e-4, "tangent": "laws"}), ("esdirk436", {"rtol": 1e-5}),
     ("genalpha", {"rtol": 1e-3}), ("genalpha", {"step": 0.01, "tangent": "laws"})],
)  # fmt: skip
@pytest.mark.parametrize("spin", [0.0, 20.0])
def test_a_run_continues_bit_for_bit_from_every_step(
    method: str, how: dict[str, Any], spin: float
) -> None:
    model = looped_model(scenes.bushed_rods(4, 1e6, 0.01))
    settings = validate(Settings(0.3, method=method, atol=1e-6, **how))
    q, u = model.initial_state()
    u = np.array(u)
    u[2] = spin  # laws alone do not serve then
    systems: list[SceneSystem] = []

    def fresh() -> Integrator:
        systems.append(SceneSystem(model.looped))
        return make_run(systems[-1], settings, q, u)

    whole, run = fresh(), fresh()
    assert whole.advance(60.0) is Status.FINISHED
    parts, steps = [], 0
    while run.advance(60.0, steps + 1) is Status.RUNNING:
        steps = run.statistics.steps
        parts.append(run.take_samples())
        state = run.state()
        run = fresh()
        run.restore(state)
    found = Samples.join([*parts, run.samples])
    assert np.array_equal(found.y, whole.samples.y)
    assert run.statistics == whole.statistics
    assert whole.statistics.approximate_tangents > 0


def test_code_of_the_scene_keeps_the_exact_tangent_unless_asked() -> None:
    """There the exact one is a few lines; by laws alone both engines make the same run."""
    looped, fused = (compile_scene(mixed_laws_scene(), engine) for engine in ("looped", "fused"))
    how: dict[str, Any] = {"rtol": 1e-6, "atol": 1e-8}
    assert run_with_statistics(fused, "esdirk436", **how)[1].approximate_tangents == 0
    for method in ("rodas4pw", "esdirk436"):
        found, statistics = run_with_statistics(fused, method, tangent="laws", **how)
        expected, other = run_with_statistics(looped, method, tangent="laws", **how)
        assert statistics.approximate_tangents == other.approximate_tangents > 0
        assert found == pytest.approx(expected, abs=1e-9)


def test_methods_that_need_the_exact_one_say_so() -> None:
    for method in set(IMPLICIT) - {*W_METHODS, *ITERATED_METHODS}:
        with pytest.raises(SceneError, match=f"{method} has a low order"):
            validate(Settings(1.0, method=method, tangent="laws"))
    for method in (*EXPLICIT, "auto", "scipy-Radau"):
        for tangent in ("laws", "exact"):
            with pytest.raises(SceneError, match="has no tangent to choose"):
                validate(Settings(1.0, method=method, tangent=tangent))
    with pytest.raises(SceneError, match="expected one of auto, exact, laws"):
        validate(Settings(1.0, method="rodas4pw", tangent="law"))


def test_a_result_keeps_which_tangent_was_taken(tmp_path: Any) -> None:
    model = looped_model(mixed_laws_scene())
    result = model.simulate(
        0.1, mstmm.methods.Implicit("rodas4pw", tangent="laws"), rtol=1e-4, atol=1e-7
    )
    result.save(tmp_path / "by_laws.nc")
    loaded = mstmm.load_result(tmp_path / "by_laws.nc")
    assert loaded.statistics == result.statistics
    assert loaded.settings.tangent == "laws"


def test_a_batch_takes_it_too() -> None:
    model = looped_model(mixed_laws_scene())
    q, u = model.initial_state()
    by_laws, by_all = (
        mstmm.methods.Implicit("rodas4pw", tangent=tangent) for tangent in ("laws", "exact")
    )
    batch = model.simulate_batch((q[None], u[None]), t_end=0.2, method=by_laws, step=0.01)
    alone = model.simulate(0.2, by_laws, step=0.01, output_times=[0.2])
    assert batch.q[0, -1] == pytest.approx(alone.q[-1], abs=1e-12)
    exact = model.simulate(0.2, by_all, step=0.01, output_times=[0.2])
    assert np.abs(exact.q[-1] - alone.q[-1]).max() > 1e-12
