"""What implicit methods ask of a small scene, as code of its own: the looped engine's numbers.

The kernels are replayed in floats on drawn trees; runs go by the compiled code.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

import mstmm
from mstmm.errors import EnvironmentFailure
from mstmm.ir.interpreter import evaluate_floats
from mstmm.pipeline.fused_code import Fusion
from mstmm.runtime.engine.tangent_matrix import TangentMatrix
from mstmm.runtime.packing.fused_structure import structure_of
from mstmm.runtime.result.result import Result
from mstmm.runtime.run.scene_system import SceneSystem
from tests.reference.jets import Array
from tests.runtime.engine.test_tangent_matrix import model_and_tangent, random_rigid_scene, worst
from tests.support.draws import draws
from tests.support.scenes import random_flexible as engine_scenes

Scene = dict[str, Any]

TIME, STEPS = 0.3, (2000.0, 1500.0, 1.0)
UNIT = 2.0**-53


class Fused:
    """The kernels of a scene at one state, replayed in floats."""

    def __init__(self, model: mstmm.Model, memory: Array, q: Array, u: Array, a: Array) -> None:
        assert isinstance(model.fusion, Fusion)
        structure, p = structure_of(model.packed_scene.system, model.known or {})
        self.kernels = model.fusion.fused_implicit(structure).kernels
        self.state: dict[str, Any] = {
            "p": p, "t": [TIME], "q": q, "u": u, "a": a, "steps": STEPS,
            "memory": memory[: structure.n_memory],
        }  # fmt: skip

    def run(self, name: str, **more: Any) -> dict[str, Array]:
        """The outputs of a kernel."""
        given = self.state | more
        inputs = {port.name: list(given[port.name]) for port in self.kernels[name].inputs}
        found = evaluate_floats(self.kernels[name], inputs)
        return {port: np.array(values) for port, values in found.items()}


def check(scene: Scene, q: Array, u: Array, rng: Generator) -> None:
    """Residual, its rate, coordinates and solutions; entries of imposed speeds are zero."""
    model, looped = model_and_tangent(scene)
    nq, nu = looped.nq, looped.nu
    a, d_q, d_a, right, rho = (rng.normal(size=n) for n in (nu, nq, nu, nu, nq))
    expected = looped.residual(TIME, q, u, a)
    fused = Fused(model, looped.memory, q, u, a)
    assert worst(fused.run("residual")["r"], expected) < 1e-10
    assert worst(fused.run("residual_power")["r"], expected) < 1e-10
    still = [0 * values for values in (d_q, d_a, d_a)]
    assert worst(fused.run("residual_rate")["r_t"], looped.slope(1.0, *still)) < 1e-10
    looped.factor(*STEPS)
    answer = looped.solve(right)
    free = answer != 0
    d_q, d_a = looped.coordinates(0 * answer, d_q), np.where(free, d_a, 0.0)
    moved = looped.slope(0.0, d_q, 0 * answer, d_a)
    lost = worst(right + moved, right) * UNIT
    for name in [name for name in fused.kernels if name.startswith("tangent")]:
        made = {"slopes": np.zeros(nu * (nq + nu)), **fused.run(name)}
        rest = fused.run("rest", slopes=made["slopes"], r=right + moved, dq=d_q, da=d_a)["rest"]
        if name == "tangent" and "tangent_slopes" in fused.kernels:
            rest = right
        found = fused.run("solution", factors=made["factors"], r=np.where(free, rest, 0.0))["x"]
        assert worst(found, answer) < max(1e-11, 100 * (UNIT + lost) * condition(looped))
    changes = fused.run("coordinates", x=answer, rho=rho)["dq"]
    assert worst(changes, looped.coordinates(answer, rho)) < 1e-11


def condition(tangent: TangentMatrix) -> float:
    """Of the tangent, its rows and columns scaled."""
    columns = [
        tangent.slope(0.0, tangent.coordinates(unit), unit, STEPS[0] * unit)
        for unit in np.eye(tangent.nu)
    ]
    matrix = np.array(columns).reshape(tangent.nu, tangent.nu).T
    rows = np.flatnonzero(np.abs(matrix).max(axis=1, initial=0.0) > 0)
    matrix = matrix[np.ix_(rows, rows)]
    size = np.sqrt(np.abs(np.diag(matrix)))
    return float(np.linalg.cond(matrix / np.outer(size, size))) if len(rows) else 1.0


@pytest.mark.parametrize("draw", draws(3, 8))
def test_rigid_trees(draw: int, rng: Generator) -> None:
    """Every hinge, laws with friction and stops, efforts, loads and springs anywhere."""
    check(*random_rigid_scene(rng), rng)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("draw", draws(2, 4))
def test_flexible_trees(draw: int, rng: Generator) -> None:
    check(*small(rng, draw % 2 == 0), rng)


def small(rng: Generator, planar: bool) -> tuple[Scene, Array, Array]:
    """A drawn flexible scene of few speeds, as such code is made for."""
    while True:
        scene, q, u = engine_scenes.seeded_scene(int(rng.integers(2**32)), planar, 2)
        if len(u) <= 12:
            return scene, q, u


# --- runs by compiled code ------------------------------------------------------------------------


def arm(n: int, stiffness: float = 1e5) -> Scene:
    """Rods on stiff pins, a ball and a driven slider, with damping and a force."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    stiff = {"stiffness": [stiffness], "damping": [5.0]}
    hinges: list[Scene] = [{"type": "pin", "axis": [0, 1, 0], "law": stiff} for _ in range(n)]
    hinges[1] = {"type": "ball", "law": {"stiffness": [stiffness] * 3, "damping": [2.0] * 3}}
    hinges[2] = {"type": "prismatic", "axis": [1, 0, 0], "drive": "0.1*sin(3*t)"}
    return {
        "gravity": [0, 0, -9.81],
        "body": [{"name": f"rod{k}", **rod} for k in range(n)],
        "hinge": [
            {"name": f"joint{k}", "inboard": f"rod{k - 1}.tip" if k else "ground",
             "outboard": f"rod{k}", **hinge}
            for k, hinge in enumerate(hinges)
        ],
        "load": [{"name": "push", "on": f"rod{n - 1}.tip", "force": [0, "5*sin(9*t)", 0]}],
    }  # fmt: skip


def simulate_scene(
    engine: str, scene: Scene, method: str | mstmm.methods.Method, **options: Any
) -> Result:
    model = mstmm.compile(mstmm.Scene(**scene), engine=engine)
    return model.simulate(options.pop("t_end", 0.2), method=method, certify=False, **options)


@pytest.mark.parametrize("method", ["rodas4p2", "kvaerno5", "genalpha", "exprb32"])
def test_runs_equal_those_of_the_looped_engine(method: str) -> None:
    fused, looped = (
        simulate_scene(engine, arm(4), mstmm.methods.Implicit(method, tangent="exact"), step=2e-3)
        for engine in ("fused", "looped")
    )
    assert fused.success and looped.success
    errors = [run.statistics and run.statistics.sum_of_local_errors for run in (fused, looped)]
    assert errors[0] == pytest.approx(errors[1], rel=1e-3)
    assert fused.q == pytest.approx(looped.q, abs=1e-9)
    assert fused.u == pytest.approx(looped.u, abs=1e-6)
    assert fused.work == pytest.approx(looped.work, abs=1e-6)


def implicit_system(scene: Scene, engine: str = "fused", method: str = "genalpha") -> SceneSystem:
    """The system of a run that has stepped implicitly."""
    options = {"step": 2e-3} if method == "genalpha" else {"rtol": 1e-4, "atol": 1e-6}
    kept = list[SceneSystem]()
    offer = SceneSystem.offer_tangent

    def record_system(system: SceneSystem) -> None:
        offer(system)
        kept.append(system)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SceneSystem, "offer_tangent", record_system)
        assert simulate_scene(engine, scene, method, **options).success
    return kept[-1]


def test_scenes_of_many_unknowns_stay_with_the_sweep() -> None:
    assert implicit_system(arm(4)).run.implicit_code.fused
    assert not implicit_system(arm(4), "looped").run.implicit_code.fused
    assert not implicit_system(arm(20)).run.implicit_code.fused


def test_a_choice_among_methods_takes_the_code_once_it_steps_implicitly() -> None:
    system = implicit_system(arm(4, 1e9), method="auto")
    assert system.run.implicit_code.fused


def test_without_a_compiler_the_looped_engine_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    model = mstmm.compile(mstmm.Scene(**arm(4)), engine="fused")

    def fails(*_: object, known: object = None) -> None:
        raise EnvironmentFailure("no compiler")

    monkeypatch.setattr("mstmm.pipeline.fused_code.open_cached_library", fails)
    assert model.simulate(0.01, method="genalpha", step=2e-3, certify=False).success


def test_the_looped_engine_judges_pivots_that_are_not_positive() -> None:
    """A rod on end that falls faster than the step can tell: both engines say the same."""
    scene = arm(3)
    scene["body"], scene["hinge"], scene["load"] = scene["body"][:1], scene["hinge"][:1], []
    scene["hinge"][0].pop("law")
    options: Scene = {"step": 1.0, "t_end": 2.0, "initial": ([-1.57], [0.0])}
    found = [simulate_scene(engine, scene, "genalpha", **options) for engine in ("fused", "looped")]
    assert not found[0].success
    assert found[0].message == found[1].message and found[0].t[-1] == found[1].t[-1]
