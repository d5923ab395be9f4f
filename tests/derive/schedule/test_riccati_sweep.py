"""Accelerations of trees refined: the digits that they keep behind light bodies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.pipeline.extended_precision import extended_precision_accelerations, relative_error
from tests.reference import newton_euler as dense
from tests.reference.compare import seeded_scene, worst
from tests.reference.jets import Array
from tests.runtime.packing.test_scene_packing_qr import HEAVY, TIME, with_tip
from tests.support.scenes.rods import chain, drawn_state


def model_with_sweep(scene: dict[str, Any], engine: str = "looped", **options: Any) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**scene), engine, **{"sweep": "refined"} | options)


def errors(models: list[mstmm.Model], states: list[tuple[Array, Array]]) -> list[float]:
    """The worst of each beside sixty digits."""
    at = extended_precision_accelerations(models[0])
    found = [[relative_error(m.accelerations(q, u), at(q, u)) for m in models] for q, u in states]
    return [float(x) for x in np.max(found, axis=0)]


@pytest.mark.parametrize(("power", "accuracy"), [(6, 1e-14), (8, 1e-14), (10, 1e-10), (12, 1e-9)])
@pytest.mark.parametrize("name", HEAVY)
def test_a_heavy_tip(name: str, power: int, accuracy: float, rng: np.random.Generator) -> None:
    """The square of what one sweep loses is left, the cube where the start asks for two."""
    scene = with_tip(HEAVY[name], 10.0**power)
    models = [model_with_sweep(scene, sweep="riccati"), model_with_sweep(scene)]
    plain, refined = errors(models, [drawn_state(scene, rng) for _ in range(3)])
    assert refined < accuracy < 1e-3 * plain


def test_code_of_its_own(rng: np.random.Generator) -> None:
    scene = with_tip(chain(["pin"] * 4), 1e8)
    models = [model_with_sweep(scene, "fused", sweep="riccati"), model_with_sweep(scene, "fused")]
    assert models[1].engine == "fused"
    states = [drawn_state(scene, rng) for _ in range(3)]
    plain, refined = errors(models, states)
    assert refined < 1e-14 < 1e-3 * plain
    q, u = (np.array(part) for part in zip(*states, strict=True))
    assert worst(models[1].accelerations(q, u), model_with_sweep(scene).accelerations(q, u)) < 1e-14


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_rotors_laws_loads_and_drives(engine: str, rng: np.random.Generator) -> None:
    scene = with_tip(chain(["pin"] * 4, 0.6), 1e8)
    scene["load"] = [{"on": "rod3.tip", "force": [0, "1e8*cos(t)", 3e7]}]
    law = {"stiffness": [100.0], "damping": [1.0], "inertia": [0.3]}
    scene["hinge"] = [hinge | {"law": law} for hinge in scene["hinge"]]
    scene["hinge"][1] |= {"drive": "0.3*sin(2*t)", "law": {"inertia": [0.2]}}
    scene["hinge"][3] |= {"law": {"stiffness": [1e9], "inertia": [1e7]}}
    models = [model_with_sweep(scene, sweep="riccati"), model_with_sweep(scene, engine)]
    states = [tuple(rng.uniform(-1, 1, (2, 4))) for _ in range(3)]
    for q, u in states:
        q[1], u[1] = 0.0, 0.6
    assert errors(models, states)[1] < 1e-14


def test_a_flexible_body_before_the_heavy_one(rng: np.random.Generator) -> None:
    rod, heavy = chain(["pin"] * 2)["body"]
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 10.0}
    sides = [("ground", "rod0"), ("rod0.tip", "blade"), ("blade.tip", "rod1")]
    scene = {
        "gravity": [0, -9.81, 0], "beam": [beam | {"modes": 2}],
        "body": [rod, heavy | {"mass": 1e6, "inertia": [1e5] * 3}],
        "hinge": [{"name": f"pin{k}", "type": "pin", "inboard": a, "outboard": b}
                  for k, (a, b) in enumerate(sides)],
    }  # fmt: skip
    models = [
        model_with_sweep(scene, sweep="riccati"),
        model_with_sweep(scene),
        model_with_sweep(scene, "fused"),
    ]
    states = [tuple(rng.uniform(-0.1, 0.1, (2, models[0].nu))) for _ in range(3)]
    plain, looped, fused = errors(models, states)
    assert max(looped, fused) < 1e-12 < 1e-2 * plain


@pytest.mark.parametrize("seed", range(300, 312))
def test_random_trees_keep_loads_and_energy(seed: int) -> None:
    """What a refined evaluation leaves behind is read by forces, efforts and power."""
    scene, q, u = seeded_scene(seed)
    model, other = model_with_sweep(scene), model_with_sweep(scene, sweep="riccati")
    assert worst(model.accelerations(q, u, t=TIME), dense.solve(scene, q, u, TIME).udot) < 1e-12
    here: dict[str, Any] = {"t_start": TIME, "t_end": TIME, "initial": (q, u)}
    found, expected = model.simulate(**here), other.simulate(**here)
    size = max(body["mass"] for body in scene["body"])
    size *= np.abs(model.accelerations(q, u, t=TIME)).max(initial=1.0)
    for name in (hinge["name"] for hinge in scene["hinge"]):
        for quantity in ("force", "moment", "effort"):
            a, b = (np.asarray(getattr(run, quantity)(name)) for run in (found, expected))
            assert np.abs(a - b).max(initial=0.0) < 1e-11 * max(size, 1.0), (name, quantity)
    assert worst(found.energy(), expected.energy()) < 1e-13


def test_a_rotor_that_is_let_go() -> None:
    """A driven speed with a rotor: behind its release the rotor takes part in what is refined."""
    scene = with_tip(chain(["pin"] * 3, gravity=(0, -9.81, 0)), 1e7)
    rotor = {"law": {"inertia": [5.0]}}
    held = scene | {"hinge": [dict(hinge) for hinge in scene["hinge"]]}
    held["hinge"][1] |= rotor | {"drive": "0", "release": "t >= 0"}
    scene["hinge"][1] |= rotor
    runs = [model_with_sweep(one).simulate(1e-3, rtol=1e-11, atol=1e-14) for one in (held, scene)]
    assert worst(runs[0].q[-1], runs[1].q[-1]) < 1e-11


def test_solutions_of_the_mass_matrix(rng: np.random.Generator) -> None:
    scene = with_tip(HEAVY["skew pins"], 1e10)
    q, columns = rng.uniform(-1, 1, 8), rng.uniform(-1, 1, (8, 3))
    refined, plain, rows = (model_with_sweep(scene, sweep=s) for s in ("refined", "riccati", "qr"))
    exact = rows.solve(q, columns).T
    kept, lost = (max(map(relative_error, m.solve(q, columns).T, exact)) for m in (refined, plain))
    assert kept < 1e-2 * lost


def test_the_risk_of_lost_digits_is_none_there(tmp_path: Path) -> None:
    """Until the sweep has no digits to refine with; a result keeps what it was made by."""
    scene = with_tip(chain(["pin"] * 4, gravity=(0, 0, 0)), 1e11)
    run = model_with_sweep(scene).simulate(1e-3, rtol=1e-6)
    assert "pivot-loss" not in [risk.name for risk in run.risks]
    again = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert again.model.sweep == "refined"
    assert np.array_equal(again.force("hinge0"), run.force("hinge0"))


def test_masses_that_leave_no_digits() -> None:
    with pytest.raises(
        SceneError, match=r'does not reduce: heavy body "rod7" .* or use sweep = "qr"'
    ):
        model_with_sweep(with_tip(HEAVY["planar pins"], 1e18))


def test_an_implicit_run_goes_on_as_it_did() -> None:
    scene = with_tip(chain(["pin"] * 3), 1e6)
    runs = [
        model_with_sweep(scene, sweep=s).simulate(0.01, "rodas5p") for s in ("refined", "riccati")
    ]
    assert worst(runs[0].q[-1], runs[1].q[-1]) < 1e-9


def test_closed_loops_do_so_by_themselves() -> None:
    from tests.runtime.engine.loops.test_acceleration_refinement import chain as ring

    scene = ring([1.0, 1.0, 1.0, 1e6, 1.0, 1.0])
    models = [model_with_sweep(scene), model_with_sweep(scene, sweep="riccati")]
    q, u = models[0].initial_state()
    assert np.array_equal(models[0].accelerations(q, u), models[1].accelerations(q, u))
