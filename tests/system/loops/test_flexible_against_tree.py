"""Flexible bodies in closed loops, against the open tree under the forces that close it."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.array_validation import Array
from mstmm.errors import SceneError
from tests.support.scenes.published_mechanisms import rod

Scene = dict[str, Any]

CRANK, ROD, ANGLE = 0.3, 0.9, 0.6
#: The same shapes in the loop and in the open tree.
BASIS = {"frame": "tangent", "basis": "clamped-free"}


def slider_crank(cut: str = "wrist", stiffness: float = 300.0) -> Scene:
    """A crank, a beam for its rod and a slider; of its hinges `cut` closes the loop."""
    lean = np.arcsin(CRANK * np.sin(ANGLE) / ROD)
    reach = CRANK * np.cos(ANGLE) + ROD * np.cos(lean)
    slider = {"name": "slider", "mass": 0.8, "inertia": [1e-3, 1e-3, 1e-3]}
    hinges: list[Scene] = [
        {"name": "foot", "type": "pin", "inboard": "ground", "outboard": "crank",
         "initial": {"q": ANGLE, "u": 8.0}},
        {"name": "knee", "type": "pin", "inboard": "crank.tip", "outboard": "bar",
         "initial": {"q": -lean - ANGLE}},
        {"name": "guide", "type": "prismatic", "inboard": "ground", "outboard": "slider",
         "axis": [1, 0, 0], "initial": {"q": reach}},
        {"name": "wrist", "type": "pin", "inboard": "bar.tip", "outboard": "slider"},
    ]  # fmt: skip
    if cut == "turned":
        hinges[3] |= {"inboard": "slider", "outboard": "bar.tip", "cut": True}
    else:
        next(one for one in hinges if one["name"] == cut)["cut"] = True
    return {"gravity": [0, -9.81, 0], "body": [rod("crank", CRANK, 0.5), slider], "hinge": hinges,
            "beam": [{"name": "bar", "length": ROD, "mass_per_length": 1.5,
                      "bending_stiffness": stiffness, "modes": {"y": 2, "z": 0},
                      **BASIS}]}  # fmt: skip


def shackled_beam() -> Scene:
    """A cantilever with two links between its middle and its tip: the loop closes on the beam."""
    links = [rod("near", 0.4, 0.2), rod("far", 0.5, 0.3)]
    hinges: list[Scene] = [
        {"name": "root", "type": "pin", "inboard": "ground", "outboard": "bar",
         "initial": {"u": 2.0}},
        {"name": "middle", "type": "pin", "inboard": "bar.mid", "outboard": "near",
         "initial": {"q": 1.0}},
        {"name": "joint", "type": "pin", "inboard": "near.tip", "outboard": "far",
         "initial": {"q": -1.8}},
        {"name": "wrist", "type": "pin", "inboard": "far.tip", "outboard": "bar.tip", "cut": True},
    ]  # fmt: skip
    return {"gravity": [0, -9.81, 0], "body": links, "hinge": hinges,
            "beam": [{"name": "bar", "length": 1.2, "mass_per_length": 1.5,
                      "bending_stiffness": 40.0, "modes": {"y": 3, "z": 0}, **BASIS,
                      "ends": {"mid": 0.6}}]}  # fmt: skip


def hanging_bar() -> Scene:
    """Two beams in space from the ground to the ends of a bar, on balls; they bend both ways."""
    beams = [
        {"name": name, "length": 1.0, "mass_per_length": 0.8, "bending_stiffness": [30.0, 50.0],
         "torsional_stiffness": 20.0, "polar_inertia_per_length": 1e-3,
         "modes": {"y": 2, "z": 1, "twist": 1}, **BASIS}
        for name in ("left", "right")
    ]  # fmt: skip
    hinges: list[Scene] = [
        {"name": "first", "type": "ball", "inboard": "ground", "outboard": "left",
         "orientation": [0.1, 1.2, 0.2], "initial": {"u": [0.4, -1.0, 0.6]}},
        {"name": "second", "type": "ball", "inboard": "left.tip", "outboard": "bar",
         "initial": {"q": [0.92, 0.0, -0.39, 0.0]}},
        {"name": "third", "type": "universal", "axis2": [0, 1, 0],
         "inboard": "ground", "outboard": "right", "position": [1.1, 0.2, 0.0],
         "orientation": [0.0, 1.4, -0.1]},
        {"name": "wrist", "type": "ball", "inboard": "bar.tip", "outboard": "right.tip",
         "cut": True},
    ]  # fmt: skip
    bar = {"name": "bar", "mass": 0.7, "center_of_mass": [0.5, 0.05, 0],
           "inertia": [0.02, 0.06, 0.05], "ends": {"tip": [1.0, 0.1, 0]}}  # fmt: skip
    return {"gravity": [0, 0, -9.81], "body": [bar], "beam": beams, "hinge": hinges}


def meshed_slider_crank() -> Scene:
    """The slider-crank with a rod of rubber from finite elements."""
    scene = slider_crank("wrist")
    del scene["beam"]
    ends = {name: {"plane": [1, 0, 0, x]} for name, x in (("root", 0.0), ("tip", ROD))}
    bar = {"name": "bar", "box": {"size": [ROD, 0.04, 0.04], "divisions": [6, 1, 1]}, "modes": 1,
           "young": 2e7, "poisson": 0.3, "density": 1100.0, "ends": ends}  # fmt: skip
    scene["hinge"][1]["outboard"], scene["hinge"][3]["type"] = "bar.root", "ball"
    return scene | {"elastic": [bar]}


SCENES = {"meshed": (meshed_slider_crank, "slider", 3), "slider_crank": (slider_crank, "slider", 2),
          "shackled": (shackled_beam, "far.tip", 2),
          "hung": (hanging_bar, "bar.tip", 3)}  # fmt: skip


def run(scene: Scene, t_end: float = 0.3, **options: Any) -> mstmm.Result:
    result = mstmm.compile(mstmm.Scene(**scene)).simulate(
        t_end, rtol=1e-9, atol=1e-11, output_times=np.linspace(0, t_end, 4), **options
    )
    assert result.success, result.message
    return result


def opened_tree(scene: Scene, rows: int, ends: tuple[str, str]) -> mstmm.Model:
    """The tree without the wrist, and in its place equal forces on both ends by inputs."""
    tree = copy.deepcopy(scene)
    tree["hinge"] = [one for one in tree["hinge"] if one["name"] != "wrist"]
    tree["input"] = [{"name": f"pull{k}", "unit": "N", "value": 0.0} for k in range(rows)]
    force = [f"pull{k}" if k < rows else "0" for k in range(3)]
    tree["load"] = [
        {"on": end, "force": [f"{sign}{one}" for one in force]}
        for end, sign in zip(ends, ("", "-"), strict=True)
    ]
    return mstmm.compile(mstmm.Scene(**tree))


@pytest.mark.parametrize("name", SCENES)
def test_accelerations_are_those_of_the_tree_under_the_forces_that_close_it(name: str) -> None:
    made, other, rows = SCENES[name]
    scene = made()
    closed = run(scene)
    assert np.ptp(closed.energy()) < 2e-7 * max(1.0, np.abs(closed.energy()).max())
    wrist = scene["hinge"][3]
    bent = wrist["outboard"] if "tip" in wrist["outboard"] else wrist["inboard"]
    apart = closed.position(bent) - closed.position(other)
    np.testing.assert_allclose(apart[:, :rows], 0, atol=1e-9)
    slots = closed.model.coordinate_layout.hinges["wrist"]
    q, u = (np.delete(x[-1], part) for x, part in
            ((closed.q, slots.q_slice), (closed.u, slots.u_slice)))  # fmt: skip
    assert np.abs(q[-2:]).max() > 1e-6  # bent
    tree = opened_tree(scene, rows, (bent, other))

    def pulled_accelerations(forces: Array) -> tuple[Array, Array]:
        """Accelerations along the speeds, and those of the ends apart from each other."""
        model = tree.with_inputs({f"pull{k}": float(x) for k, x in enumerate(forces)})
        seen = model.simulate(1e-9, initial=(q, u), output_times=[0.0])
        apart = seen.acceleration(bent) - seen.acceleration(other)
        return seen.udot[0], apart[0, :rows]

    free, gap = pulled_accelerations(np.zeros(rows))
    columns = [pulled_accelerations(unit) for unit in np.eye(rows)]
    forces = np.linalg.solve(np.array([one - gap for _, one in columns]).T, -gap)
    known = free + sum(x * (one - free) for x, (one, _) in zip(forces, columns, strict=True))
    model = mstmm.compile(mstmm.Scene(**scene))
    found = np.delete(model.accelerations(closed.q[-1], closed.u[-1]), slots.u_slice)
    np.testing.assert_allclose(found, known, rtol=0, atol=2e-11 * np.abs(known).max())


def test_cutting_another_hinge_changes_nothing() -> None:
    found = [run(slider_crank(cut)) for cut in ("wrist", "turned", "guide")]
    for other in found[1:]:
        for hinge in ("foot", "guide"):
            np.testing.assert_allclose(
                other.coordinates(hinge), found[0].coordinates(hinge), atol=1e-7
            )
        np.testing.assert_allclose(other.position("bar.tip"), found[0].position("bar.tip"),
                                   atol=1e-7)  # fmt: skip
    loops = mstmm.compile(mstmm.Scene(**slider_crank())).loops
    assert (loops.rank, loops.mobility, loops.flexible_mobility) == (2, 3, 2)


def test_a_start_that_is_bent_stays_bent() -> None:
    """Deflections and their rates are start values as any others; the loop changes them little."""
    scene = slider_crank()
    bent, rates = [0.01, -0.002], [0.3, 0.1]
    scene["beam"][0]["initial"] = {"eta": bent, "etad": rates}
    model = mstmm.compile(mstmm.Scene(**scene))
    q, u = model.initial_state()
    slots = model.coordinate_layout.modal["bar"]
    np.testing.assert_allclose(q[slots.q_slice], bent, rtol=0.05)
    np.testing.assert_allclose(u[slots.u_slice], rates, rtol=0.05)


def test_a_stiff_rod_moves_as_a_rigid_one() -> None:
    """What it bends by goes with 1 / EI."""
    scene = slider_crank()
    scene["beam"][0]["model"] = "rigid"
    rigid = run(scene).coordinates("foot")[-1, 0]
    gaps = [abs(run(slider_crank(stiffness=ei)).coordinates("foot")[-1, 0] - rigid)
            for ei in (1e4, 1e5)]  # fmt: skip
    assert gaps[0] > 1e-6
    assert gaps[1] < 0.5 * gaps[0]


def test_batches_are_runs_one_by_one() -> None:
    model = mstmm.compile(mstmm.Scene(**slider_crank()))
    q, u = model.initial_state()
    batch = model.simulate_batch((np.array([q, q]), np.array([u, 0.5 * u])), t_end=0.2)
    assert batch.success.all()
    alone = model.simulate(0.2, initial=(q, 0.5 * u), output_times=[0.0, 0.2])
    np.testing.assert_allclose(batch.q[1, -1], alone.q[-1], atol=1e-12)


def test_a_wrist_that_lets_go_leaves_the_tree() -> None:
    """Behind the release the rod swings on as the tree that was there without the wrist."""
    tree = slider_crank()
    del tree["hinge"][2:], tree["body"][1], tree["hinge"][0]["initial"]["u"]
    open_tree = mstmm.compile(mstmm.Scene(**tree))
    place = open_tree.simulate(0.0).position("bar.tip")[0]
    angle = ANGLE + tree["hinge"][1]["initial"]["q"]
    wrist = {"name": "wrist", "type": "fixed", "inboard": "ground", "outboard": "bar.tip",
             "position": place.tolist(), "orientation": [0.0, 0.0, angle],
             "release": "t >= 0.1", "cut": True}  # fmt: skip
    held = run(tree | {"hinge": [*tree["hinge"], wrist]})
    own = held.model.coordinate_layout.hinges["wrist"]
    q, u = np.delete(held.q, own.q_slice, 1), np.delete(held.u, own.u_slice, 1)
    assert np.abs(held.position("bar.tip")[1] - place).max() < 1e-9
    free = open_tree.simulate(0.3, t_start=0.1, initial=(q[1], u[1]), rtol=1e-9, atol=1e-11)
    assert np.abs(held.position("bar.tip")[-1] - place).max() > 0.05
    np.testing.assert_allclose(q[-1], free.q[-1], atol=1e-7)


def test_a_stiff_bushing_does_as_the_hinge() -> None:
    scene = slider_crank()
    tree = copy.deepcopy(scene)
    del tree["hinge"][3]
    k, c = 3e6, 3e2
    tree["bushing"] = [
        {"from": "bar.tip", "to": "slider", "stiffness": [k, k, 0, 0, 0, 0],
         "damping": [c, c, 0, 0, 0, 0]}
    ]  # fmt: skip
    closed = run(scene)
    kept = np.delete(
        np.arange(closed.q.shape[1]), closed.model.coordinate_layout.hinges["wrist"].q_slice
    )
    soft = run(tree, initial=(closed.q[0, kept], closed.u[0, kept]))
    assert soft.coordinates("foot")[-1] == pytest.approx(closed.coordinates("foot")[-1], abs=1e-4)


@pytest.mark.parametrize(
    ("method", "order", "step"), [("rodas4", 4, 5e-4), ("kvaerno5", 5, 5e-4), ("genalpha", 2, 1e-4)]
)
def test_implicit_methods_keep_their_order(method: str, order: int, step: float) -> None:
    """Which Rosenbrock methods do by exact tangents alone."""
    model = mstmm.compile(mstmm.Scene(**slider_crank()))
    wanted = model.simulate(0.1, rtol=1e-12, atol=1e-14).q[-1]
    errors = [
        np.abs(model.simulate(0.1, method, step=one).q[-1] - wanted).max()
        for one in (step, step / 2)
    ]
    assert errors[1] < 1e-4 and errors[0] / errors[1] > 0.8 * 2**order


def test_a_stiff_rod_is_followed_by_implicit_steps() -> None:
    """Where its shapes set the steps and their vibration has died out."""
    scene = slider_crank(stiffness=1e5)
    scene["beam"][0]["damping"] = {"stiffness": 1e-4}
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    plain, chosen = (model.simulate(0.3, method=method, rtol=1e-6) for method in ("dop853", "auto"))
    assert plain.success and chosen.success
    assert plain.statistics is not None and chosen.statistics is not None
    assert chosen.statistics.steps < 0.3 * plain.statistics.steps
    np.testing.assert_allclose(chosen.q[-1], plain.q[-1], atol=1e-6)


def test_what_is_refused() -> None:
    scene = slider_crank()
    model = mstmm.compile(mstmm.Scene(**scene))
    with pytest.raises(SceneError, match='hold: there is no hinge "bar"'):
        model.assemble(hold=["bar"])
