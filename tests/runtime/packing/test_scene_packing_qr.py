"""The sweep as least squares: what it computes on any tree, and the digits that it keeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.pipeline.extended_precision import extended_precision_accelerations, relative_error
from tests.reference import newton_euler as dense
from tests.reference import random_scenes
from tests.reference.compare import fresh, seeded_scene, worst
from tests.reference.jets import Array
from tests.reference.tree import SIZES
from tests.support.scenes.rods import chain, drawn_state

ACCURACY = 1e-12
TIME = 0.3
COUNT = 8


def qr_model(scene: dict[str, Any], **options: Any) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**scene), sweep="qr", **options)


def riccati(scene: dict[str, Any]) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**scene), engine="looped", sweep="riccati")


# --- any tree -----------------------------------------------------------------------------------


def compare(scene: dict[str, Any], q: Array, u: Array) -> None:
    """Accelerations with the dense equations, loads, efforts and power with the other sweep."""
    model, expected = qr_model(scene), dense.solve(scene, q, u, TIME).udot
    assert worst(model.accelerations(q, u, t=TIME), expected) < ACCURACY
    here: dict[str, Any] = {"t_start": TIME, "t_end": TIME, "initial": (q, u)}
    found, other = model.simulate(**here), riccati(scene).simulate(**here)
    size = max(body["mass"] for body in scene["body"]) * np.abs(expected).max(initial=1.0)
    for name in (hinge["name"] for hinge in scene["hinge"]):
        for quantity in ("force", "moment", "effort"):
            a, b = (np.asarray(getattr(run, quantity)(name)) for run in (found, other))
            assert np.abs(a - b).max(initial=0.0) < 1e-11 * max(size, 1.0), (name, quantity)
    assert worst(found.energy(), other.energy()) < 1e-13


@pytest.mark.parametrize("seed", range(300, 330))
def test_random_trees(seed: int) -> None:
    compare(*seeded_scene(seed))


@pytest.mark.parametrize("kind", SIZES)
def test_chains_of_one_type(kind: str, rng: np.random.Generator) -> None:
    compare(*fresh(rng, types=(kind,), chain=True, most=5))


@pytest.mark.parametrize("seed", range(330, 336))
def test_driven_coordinates(seed: int) -> None:
    types = ("pin", "cylindrical", "planar", "universal", "gimbal", "screw", "prismatic")
    scene = random_scenes.random_scene(seed, types=types, most=5)
    for number, hinge in enumerate(scene["hinge"]):
        if number % 2 == 0:
            free = ["free"] * (SIZES[hinge["type"]][1] - 1)
            hinge["drive"] = ["0.3*sin(2*t)^2 + 0.1*exp(-t)", *free]
    q, u = random_scenes.random_state(scene, seed)
    dense.fill_driven(scene, q, u, TIME)
    compare(scene, q, u)


# --- heavy bodies behind light ones -------------------------------------------------------------

HEAVY: dict[str, dict[str, Any]] = {
    "planar pins": chain(["pin"] * COUNT),
    "skew pins": chain(["pin"] * COUNT, 0.6),
    "balls": chain(["ball"] * COUNT, 0.6),
    "free root": chain(["free", *["pin"] * (COUNT - 1)], 0.6),
}


def with_tip(scene: dict[str, Any], ratio: float) -> dict[str, Any]:
    """The last body so many times as heavy."""
    *others, tip = scene["body"]
    heavy = tip | {"mass": ratio, "inertia": [ratio * value for value in tip["inertia"]]}
    return scene | {"body": [*others, heavy]}


def errors(scene: dict[str, Any], rng: np.random.Generator) -> tuple[float, float]:
    """Of least squares, and of the Riccati sweep: the middle one of five states.  Of least squares
    one state in a hundred errs by more than 1e-13."""
    models, found = (qr_model(scene), riccati(scene)), list[list[float]]()
    at = extended_precision_accelerations(models[1])
    for _ in range(5):
        q, u = drawn_state(scene, rng)
        exact = at(q, u)
        found.append([relative_error(model.accelerations(q, u), exact) for model in models])
    assert max(mine for mine, _ in found) < 1e-9
    mine, other = np.median(found, axis=0)
    return float(mine), float(other)


@pytest.mark.parametrize("power", [0, 4, 8, 12])
@pytest.mark.parametrize("name", HEAVY)
def test_a_heavy_tip_costs_no_digits(name: str, power: int, rng: np.random.Generator) -> None:
    mine, other = errors(with_tip(HEAVY[name], 10.0**power), rng)
    assert mine < 1e-13
    assert power < 8 or other > 1e-18 * 10.0**power


@pytest.mark.parametrize("share", [1e-5, 1e-8])
@pytest.mark.parametrize("kind", ["pin", "ball"])
def test_a_heavy_tip_may_be_small(kind: str, share: float, rng: np.random.Generator) -> None:
    """Its inertia about the mass centre is that part of mass times lever squared."""
    scene = with_tip(chain([kind] * 6, 0.6), 1e8)
    scene["body"][-1]["inertia"] = [share * 1e8] * 3
    mine, other = errors(scene, rng)
    assert mine < 1e-13 and other > 1e-11


def test_masses_that_grow_along_a_chain(rng: np.random.Generator) -> None:
    scene = chain(["pin"] * COUNT, 0.6, masses=[100.0**k for k in range(COUNT)])
    assert errors(scene, rng)[0] < 1e-13


def test_loads_springs_and_rotors_at_a_heavy_tip(rng: np.random.Generator) -> None:
    """Loads as large as the tip is heavy are taken by rows as its inertia is."""
    scene = with_tip(HEAVY["skew pins"], 1e10)
    scene["load"] = [{"on": f"rod{COUNT - 1}.tip", "force": [0, "1e10*cos(t)", 3e9]}]
    law = {"stiffness": [100.0], "damping": [1.0]}
    scene["hinge"] = [hinge | {"law": law} for hinge in scene["hinge"]]
    scene["hinge"][-1] |= {"law": {"stiffness": [1e11], "inertia": [1e9]}}
    mine, other = errors(scene, rng)
    assert mine < 1e-12 and other > 1e-9


@pytest.mark.parametrize("inertia", [(0.0, 0.0, 0.0), (0.0, 1 / 12, 1 / 12)])
@pytest.mark.parametrize("skew", [0.0, 0.6])
def test_points_thin_rods_and_bodies_without_mass(
    inertia: tuple[float, ...], skew: float, rng: np.random.Generator
) -> None:
    """Rows of singular mass matrices; the load that they cannot take goes on as it is."""
    scene = chain(["pin"] * 5, skew, inertia=inertia)
    if skew:  # of a straight chain in the plane the start would be undetermined
        scene["body"][2] |= {"mass": 0.0, "inertia": [0.0, 0.0, 0.0]}
    assert errors(scene, rng)[0] < 1e-12


@pytest.mark.parametrize("sweep", ["riccati", "qr"])
def test_an_undetermined_motion_is_refused(sweep: str) -> None:
    scene = mstmm.Scene(**chain(["ball"] * 3, inertia=(0.0, 1 / 12, 1 / 12)))
    with pytest.raises(SceneError, match="undetermined"):
        mstmm.compile(scene, sweep=sweep)


# --- runs ---------------------------------------------------------------------------------------


def test_a_run_is_that_of_the_other_sweep() -> None:
    scene = chain(["pin"] * 4, 0.6)
    runs = [m.simulate(2.0, rtol=1e-11, atol=1e-13) for m in (qr_model(scene), riccati(scene))]
    assert all(run.success for run in runs)
    assert worst(runs[0].q[-1], runs[1].q[-1]) < 1e-8


def test_a_run_with_a_heavy_tip_needs_no_steps_for_rounding() -> None:
    """What the Riccati sweep errs by from one evaluation to the next, steps take for motion."""
    scene = with_tip(chain(["pin"] * 6, inertia=(0.1, 0.1, 0.1), gravity=(0, 0, 0)), 1e10)
    for hinge, angle in zip(scene["hinge"], (0.5, -1.0, 0.8, 0.5, -0.7, 0.4), strict=True):
        hinge["initial"] = {"q": [angle], "u": [0.1 * (hinge["name"] == "hinge0")]}
    runs = [model.simulate(0.02, rtol=1e-9) for model in (qr_model(scene), riccati(scene))]
    assert all(run.success for run in runs)
    mine, other = (run.trajectory.statistics for run in runs)
    assert mine is not None and other is not None
    assert 100 * mine.evaluations < other.evaluations
    assert worst(runs[0].q[-1], runs[1].q[-1]) < 1e-9


def test_other_numbers_and_many_states_at_once(rng: np.random.Generator) -> None:
    scene = with_tip(chain(["pin"] * 4), 1e9)
    changes = {f"rod3.inertia[{k}]": scene["body"][3]["inertia"][k] for k in range(3)}
    model = qr_model(chain(["pin"] * 4)).with_parameters({"rod3.mass": 1e9, **changes})
    states = [drawn_state(scene, rng) for _ in range(3)]
    q, u = (np.array(part) for part in zip(*states, strict=True))
    exact = extended_precision_accelerations(riccati(scene))
    for found, state in zip(model.accelerations(q, u), states, strict=True):
        assert relative_error(found, exact(*state)) < 1e-10


def test_solutions_of_the_mass_matrix(rng: np.random.Generator) -> None:
    """M^-1 times columns is the acceleration, at rest and without weight, by efforts of laws."""
    still = with_tip(chain(["pin"] * COUNT, 0.6, gravity=(0, 0, 0)), 1e10)
    q, columns = rng.uniform(-1, 1, COUNT), rng.uniform(-1, 1, (COUNT, 3))
    found, other = (model.solve(q, columns) for model in (qr_model(still), riccati(still)))
    gaps = list[tuple[float, float]]()
    for k, column in enumerate(columns.T):
        laws = [{"law": {"effort": repr(float(tau))}} for tau in column]
        pushed = [hinge | law for hinge, law in zip(still["hinge"], laws, strict=True)]
        exact = extended_precision_accelerations(riccati(still | {"hinge": pushed}))(
            q, np.zeros(COUNT)
        )
        gaps.append((relative_error(found[:, k], exact), relative_error(other[:, k], exact)))
    mine, lost = np.median(gaps, axis=0)
    assert mine < 1e-12 and lost > 1e-9


@pytest.mark.parametrize("seed", range(336, 342))
def test_solutions_on_any_tree(seed: int, rng: np.random.Generator) -> None:
    scene = random_scenes.random_scene(seed)
    q, _ = random_scenes.random_state(scene, seed)
    models = qr_model(scene), riccati(scene)
    columns = rng.uniform(-1, 1, (models[0].nu, 2))
    assert worst(models[0].solve(q, columns), models[1].solve(q, columns)) < 1e-11


# --- what it does not do ------------------------------------------------------------------------


def test_no_fused_code_and_no_flexible_bodies() -> None:
    scene = chain(["pin"] * 2)
    with pytest.raises(SceneError, match='sweep = "qr" has no fused code'):
        qr_model(scene, engine="fused")
    assert (
        qr_model(scene).engine_reason
        == "looped: the least-squares sweep exists only in the looped engine"
    )
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0}
    bent = {
        "gravity": [0, 0, 0], "beam": [beam | {"modes": 2}],
        "hinge": [{"name": "root", "type": "pin", "inboard": "ground", "outboard": "blade"}],
    }  # fmt: skip
    with pytest.raises(SceneError, match=r'"blade": sweep = "qr" needs rigid bodies'):
        qr_model(bent)
    assert qr_model(bent, flexibility="rigid").nu == 1


@pytest.mark.parametrize(
    "inertia", [[-0.1, 0.1, 0.1], [0.1, 0.1, 0.1, 0.3, 0, 0], [0, 0, 0.1, 1e-3, 0, 0]]
)
def test_negative_moments_of_inertia_are_refused(inertia: list[float]) -> None:
    scene = chain(["pin"] * 3, 0.4) | {"allow_unphysical_inertia": True}
    scene["body"][1]["inertia"] = inertia
    assert riccati(scene).nu == 3
    with pytest.raises(
        SceneError, match='body "rod1": sweep = "qr" needs a positive semidefinite mass matrix'
    ):
        qr_model(scene)


def test_moments_that_only_break_the_triangle_are_taken(rng: np.random.Generator) -> None:
    scene = chain(["pin"] * 3, 0.4, inertia=(0, 0, 0.1)) | {"allow_unphysical_inertia": True}
    assert errors(scene, rng)[0] < 1e-13


@pytest.mark.parametrize("method", ["genalpha", "rodas4p2", "kvaerno5", "dttmm-classical"])
def test_implicit_and_classical_methods_are_refused(method: str) -> None:
    with pytest.raises(SceneError, match='sweep = "qr" gives accelerations'):
        qr_model(chain(["pin"] * 2)).simulate(0.1, method, step=1e-3)


def test_second_opinions_integrate_the_same_accelerations() -> None:
    scene = with_tip(chain(["pin"] * 4), 1e6)
    model = qr_model(scene)
    runs = [model.simulate(1e-3, name, rtol=1e-9) for name in ("dop853", "scipy-Radau")]
    assert all(run.success for run in runs)
    assert worst(runs[0].q[-1], runs[1].q[-1]) < 1e-7


def test_automatic_methods_stay_explicit() -> None:
    scene = chain(["pin"] * 2)
    scene["hinge"][1]["law"] = {"stiffness": [1e6], "damping": [1e4]}
    run = qr_model(scene).simulate(0.2, "auto", rtol=1e-6)
    assert run.success
    assert [stretch.method for stretch in run.trajectory.methods] == ["dop853", "dop853"]
    assert 'sweep = "qr" gives accelerations' in run.trajectory.methods[-1].reason
    other = riccati(scene).simulate(0.2, "auto", rtol=1e-6).trajectory.methods
    assert other[-1].method not in ("dop853", "dopri5")


def test_the_risk_of_lost_digits_names_the_way_out_and_is_none_there(tmp_path: Path) -> None:
    scene = with_tip(chain(["pin"] * 4, gravity=(0, 0, 0)), 1e11)
    runs = [model.simulate(1e-3, rtol=1e-6) for model in (qr_model(scene), riccati(scene))]
    (risk,) = (risk for risk in runs[1].risks if risk.name == "pivot-loss")
    assert 'sweep = "refined"' in risk.remedy
    assert not [risk for risk in runs[0].risks if risk.name == "pivot-loss"]
    again = mstmm.load_result(runs[0].save(tmp_path / "run.nc"))
    assert not [risk for risk in again.risks if risk.name == "pivot-loss"]
    assert np.array_equal(again.force("hinge0"), runs[0].force("hinge0"))


# --- chosen by the guard ------------------------------------------------------------------------


def heavy_tip(mass: float) -> mstmm.Scene:
    return mstmm.Scene(**chain(["pin"] * COUNT, masses=[1.0] * (COUNT - 1) + [mass]))


@pytest.mark.parametrize(
    ("tip", "sweep"), [(1.0, "riccati"), (1e6, "riccati"), (1e10, "refined"), (1e15, "qr")]
)
def test_the_sweep_is_chosen_by_the_digits_that_the_start_loses(tip: float, sweep: str) -> None:
    scene = heavy_tip(tip)
    model = mstmm.compile(scene)
    assert model.sweep == sweep
    usual = mstmm.compile(scene, sweep="riccati")
    q, u = usual.initial_state()
    risks = {
        one: [risk.name for risk in made.simulate(1e-6, initial=(q, u)).risks]
        for one, made in (("usual", usual), ("auto", model))
    }
    assert "pivot-loss" not in risks["auto"]
    assert ("pivot-loss" in risks["usual"]) == (sweep != "riccati")
    best = mstmm.compile(scene, sweep="qr").accelerations(q, u)
    assert worst(model.accelerations(q, u), best) < (1e-7 if sweep == "riccati" else 1e-11)


def test_what_a_scene_cannot_have_is_not_chosen() -> None:
    """Flexible bodies have no rows, code of a scene has no least squares."""
    beam = {"name": "beam", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1e4,
            "modes": {"y": 1}}  # fmt: skip
    tables = heavy_tip(1e15).model_dump(by_alias=True, exclude_defaults=True)
    hinge = {"name": "last", "type": "pin", "inboard": f"rod{COUNT - 1}.tip", "outboard": "beam"}
    bent = mstmm.Scene(**{**tables, "beam": [beam], "hinge": [*tables["hinge"], hinge]})
    assert mstmm.compile(bent).sweep in ("riccati", "refined")
    assert mstmm.compile(heavy_tip(1e10), engine="fused").sweep == "refined"
