"""Scenes with chains against the same scenes written out body by body."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.model.model import Model
from mstmm.scene import Scene
from tests.support.scenes.expanded_chains import plain_name, written_out

Array = NDArray[np.float64]
Data = dict[str, Any]

ROD = {
    "mass": 1.0, "center_of_mass": [0.5, 0.1, 0], "inertia": [0.1, 0.084, 0.09],
    "ends": {"tip": [1, 0, 0]},
}  # fmt: skip
BENT = {
    "mass": 2.0, "center_of_mass": [0.4, 0, 0.1], "inertia": [0.1, 0.08, 0.09, 0.01, 0, 0.002],
    "ends": {"side": [0, 0.3, 0],
             "tip": {"position": [1, 0, 0.2], "orientation": [0.1, 0.2, 0.3]}},
}  # fmt: skip
HINGES: list[Data] = [
    {"type": "pin", "axis": [1, 0, 0], "initial": {"q": [0.2], "u": [0.1]}},
    {"type": "ball", "law": {"stiffness": 3.0, "damping": 0.1, "effort": ["2*u[0]", "sin(t)", 1]}},
    {"type": "universal", "axis": [0, 1, 0], "axis2": [1, 0, 0], "orientation": [0.1, 0.2, 0.3],
     "law": {"stiffness": 1.0, "effort": ["cos(t)", "rope[6].hinge.u"], "inertia": 0.1}},
    {"type": "fixed", "orientation": [0, 0.1, 0]},
    {"type": "pin", "drive": "0.1*sin(t)"},
    {"type": "gimbal", "law": {"friction": {"coulomb": 0.1}}},
]  # fmt: skip


def chain(name: str, count: int, inboard: str, **changes: Any) -> Data:
    return {"name": name, "count": count, "inboard": inboard, "body": [ROD, BENT],
            "hinge": HINGES, "end": "tip"} | changes  # fmt: skip


def rope(count: int = 6) -> Data:
    """A chain of balls alone, and a light pattern that repeats oddly."""
    return {"gravity": [0, 0, -9.81], "chain": [
        chain("rope", count, "ground", body=ROD, hinge={"type": "ball"}, position=[0, 0, 1]),
    ]}  # fmt: skip


def branched_scene() -> Data:
    return {
        "gravity": [0, 1.0, -9.81],
        "body": [{"name": "weight", **BENT}],
        "hinge": [{"name": "hook", "type": "planar", "inboard": "rope[5].side",
                   "outboard": "weight"}],
        "chain": [
            chain("rope", 23, "ground", position=[1, 2, 3], orientation=[0.5, -0.2, 0.1]),
            chain("side", 7, "rope[3].tip", hinge=HINGES[:3]),
            chain("twig", 8, "side[last].tip", body=ROD, orientation=[0.9, 0.1, 0.3, 0]),
            chain("other", 11, "ground", hinge=[HINGES[3], HINGES[0]]),
        ],
        "load": [{"on": "rope[last].tip", "force": [0, "1 + rope[6].hinge.q + cos(t)", 0]},
                 {"on": "twig[2]", "moment": [1, "rope[1].hinge.u[2]", 0], "axes": "other[5]"}],
        "spring": [{"from": "side[2].tip", "to": "other[last].tip",
                    "law": {"stiffness": 5.0, "effort": "0.1*q + twig[0].hinge.q"}}],
    }  # fmt: skip


def unsimplified_model(data: Data) -> Model:
    return mstmm.compile(Scene(**data), engine="looped", simplify=False)


def coordinate_places(model: Model, plain: Model) -> tuple[list[int], list[int]]:
    """Places in q and u of the scene that is written out."""
    q, u = plain.coordinate_layout.q_names, plain.coordinate_layout.u_names
    return (
        [q.index(plain_name(name)) for name in model.coordinate_layout.q_names],
        [u.index(plain_name(name)) for name in model.coordinate_layout.u_names],
    )


@pytest.mark.parametrize(
    "data", [rope(), rope(1), branched_scene()], ids=["balls", "one", "branched"]
)
def test_a_chain_is_the_scene_written_out_to_the_last_bit(
    data: Data, rng: np.random.Generator
) -> None:
    model, plain = unsimplified_model(data), unsimplified_model(written_out(data))
    places_q, places_u = coordinate_places(model, plain)
    q, u = model.initial_state()
    start = plain.initial_state()
    assert np.array_equal(q, start[0][places_q]) and np.array_equal(u, start[1][places_u])
    for _ in range(3):
        q, u = q + 0.1 * rng.standard_normal(model.nq), rng.standard_normal(model.nu)
        plain_q, plain_u = np.empty(plain.nq), np.empty(plain.nu)
        plain_q[places_q], plain_u[places_u] = q, u
        found = model.accelerations(q, u, 0.7)
        assert np.array_equal(found, plain.accelerations(plain_q, plain_u, 0.7)[places_u])
        needed = plain.inverse_dynamics(plain_q, plain_u, np.zeros(plain.nu), 0.7)[places_u]
        assert np.array_equal(model.inverse_dynamics(q, u, np.zeros(model.nu), 0.7), needed)


def random_chain_scene(rng: np.random.Generator) -> Data:
    """Chains on chains: patterns, lengths (also shorter than a period) and places by chance."""
    own = [{key: x for key, x in hinge.items() if key != "law"} for hinge in HINGES]
    chains: list[Data] = []
    for number in range(int(rng.integers(1, 5))):
        count = int(rng.integers(1, 12))
        inboard = "ground"
        if chains and rng.random() < 0.8:
            other = chains[int(rng.integers(len(chains)))]
            inboard = f"{other['name']}[{rng.integers(other['count'])}].tip"
        tables = [own[k] for k in rng.integers(len(own), size=rng.integers(1, count + 1))]
        for hinge in tables:
            hinge["orientation"] = rng.choice([0.0, np.pi / 2, 0.3], size=3).tolist()
        bodies = [ROD, BENT] if count > 1 and rng.random() < 0.5 else ROD
        chains.append(chain(f"c{number}x", count, inboard, body=bodies, hinge=tables))
    return {"gravity": [0.3, 1.0, -9.81], "chain": chains}


@pytest.mark.parametrize("draw", range(8))
def test_drawn_chains_are_the_scenes_written_out(draw: int, rng: np.random.Generator) -> None:
    data = random_chain_scene(np.random.default_rng([draw, int(rng.integers(2**31))]))
    model, plain = unsimplified_model(data), unsimplified_model(written_out(data))
    q, u = model.initial_state()
    assert model.coordinate_layout.q_names == [*map(member_name, plain.coordinate_layout.q_names)]
    q, u = q + 0.3 * rng.standard_normal(model.nq), u + rng.standard_normal(model.nu)
    assert np.array_equal(model.accelerations(q, u, 0.4), plain.accelerations(q, u, 0.4)), data


def member_name(name: str) -> str:
    """c0x[3].hinge.angle of c0x_3_hinge.angle."""
    return re.sub(r"(c\dx)_(\d+)_hinge", r"\1[\2].hinge", name)


def test_names_and_places_of_the_layout() -> None:
    layout = unsimplified_model(branched_scene()).coordinate_layout
    assert [layout.q_name(i) for i in range(layout.nq)] == layout.q_names
    assert [layout.u_name(i) for i in range(layout.nu)] == layout.u_names
    assert list(layout.hinges)[:2] == ["hook", "rope[0].hinge"]
    entries = [(s.q + k, s.quaternion) for s in layout.hinges.values() for k in range(s.nq)]
    assert [place for place, _ in entries] == list(range(layout.nq))
    quaternions = [s.q + s.quaternion for s in layout.hinges.values() if s.quaternion is not None]
    assert layout.quaternions.tolist() == quaternions
    assert layout.hinges["rope[last].hinge"] == layout.hinges["rope[22].hinge"]
    assert "rope[23].hinge" not in layout.hinges and "rope[0]" not in layout.hinges


@pytest.fixture(scope="module")
def runs() -> tuple[Any, Any]:
    data = branched_scene()
    settings: Data = {"t_end": 0.1, "rtol": 1e-8, "output_times": [0, 0.05, 0.1]}
    model, plain = unsimplified_model(data), unsimplified_model(written_out(data))
    return model.simulate(**settings), plain.simulate(**settings)


def test_quantities_of_members(runs: tuple[Any, Any]) -> None:
    run, plain = runs
    assert run.success and plain.success
    for name in ("rope[0]", "rope[22].tip", "side[3].side", "twig[last].tip", "weight"):
        written = plain_name(name.replace("last", "7"))
        for kind in ("position", "velocity", "orientation", "acceleration"):
            found, wanted = getattr(run, kind)(name), getattr(plain, kind)(written)
            assert np.allclose(found, wanted, rtol=1e-6, atol=1e-6), (name, kind)
    for name in ("rope[0].hinge", "rope[4].hinge", "hook"):
        for kind in ("force", "moment", "effort", "coordinates", "speeds"):
            found, wanted = getattr(run, kind)(name), getattr(plain, kind)(plain_name(name))
            assert np.allclose(found, wanted, rtol=1e-6, atol=1e-6), (name, kind)
    assert np.array_equal(run.quantity("side[3].tip.vx").values, run.velocity("side[3].tip")[:, 0])
    angle = run.quantity("rope[6].hinge.angle").values
    assert np.array_equal(angle, run.coordinates("rope[6].hinge")[:, 0])
    assert np.array_equal(angle, run.quantity("rope[6].hinge.q").values)
    assert "rope[22].tip.position" in run.quantity_names()
    np.testing.assert_allclose(run.energy(), plain.energy(), rtol=1e-9)
    assert run.certificate.energy.largest <= 1e-6 * run.certificate.energy.scale
    assert run.certificate.singularity_distance.hinge.endswith("].hinge")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "rope[23].tip",
            '"rope[23].tip": there is no body "rope[23]"; the chain "rope" has rope[0]',
        ),
        (
            "rope.tip",
            '"rope.tip": there is no body "rope"; the chain "rope" has rope[0] to rope[22]',
        ),
        ("rope[1].top", '"rope[1].top": there is no such body or end in the scene; did you mean'),
    ],
)
def test_members_that_are_not_there(runs: tuple[Any, Any], name: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        runs[0].position(name)
    assert message in str(caught.value)
    with pytest.raises(SceneError, match=r'the chain "rope" has rope\[0\].hinge to'):
        runs[0].force("rope[23].hinge")


def test_results_of_chains_go_to_files_and_back(runs: tuple[Any, Any], tmp_path: Path) -> None:
    again = mstmm.load_result(runs[0].save(tmp_path / "run.nc"))
    assert np.array_equal(again.position("rope[last].tip"), runs[0].position("rope[22].tip"))
    header = runs[0].save(tmp_path / "run.csv").read_text(encoding="utf-8").split("\n", 1)[0]
    assert "rope[6].hinge.angle [rad]" in header


def test_parameters_stand_for_all_members() -> None:
    data = rope()
    model = unsimplified_model(data)
    assert model.parameters["rope.body[0].mass"] == 1.0
    assert not any(name.startswith("rope.count") for name in model.parameters)
    heavy = model.with_parameters({"rope.body.mass": 2.5, "rope.position[2]": 4.0})
    assert heavy.scene.chain[0].body[0].mass == 2.5
    assert heavy.scene.chain[0].position == (0.0, 0.0, 4.0)
    q, u = model.initial_state()
    wanted = unsimplified_model(
        {**data, "chain": [data["chain"][0] | {"body": ROD | {"mass": 2.5}}]}
    )
    assert np.array_equal(heavy.accelerations(q, u), wanted.accelerations(q, u))
    both = unsimplified_model(branched_scene()).with_parameters(
        {"side.body.mass": 3.0, "side.body[1].mass": 4.0}
    )
    assert [body.mass for body in both.scene.chain[1].body] == [3.0, 4.0]
    twice = {"rope.body[0].mass": 2.5, "rope.body.mass": 4.0}
    with pytest.raises(SceneError, match="are the same number"):
        model.with_parameters(twice)
    with pytest.raises(SceneError, match=r'parameter "rope\.count"'):
        model.with_parameters({"rope.count": 7.0})


def test_events_see_members() -> None:
    data = rope() | {"event": [{"when": "rope[last].tip.z < 0.9", "do": "stop"}]}
    run = unsimplified_model(data).simulate(1.0)
    assert run.success and run.t[-1] < 1.0
    assert run.position("rope[5].tip")[-1, 2] == pytest.approx(0.9, abs=1e-8)
