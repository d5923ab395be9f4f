"""What is on a stage is where the run says it is, in between samples too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.errors import EnvironmentFailure, SceneError
from mstmm.runtime.flexible.elastic.modal_elastic import elastic_model
from mstmm.runtime.flexible.elastic.surface_mesh import MAX_NODES, skin
from mstmm.runtime.result.scene3d import geometry
from mstmm.runtime.result.scene3d.frame_times import natural_speed
from mstmm.runtime.result.scene3d.projection import FIELD_OF_VIEW, choose_camera
from mstmm.runtime.result.scene3d.scene_builder import build_scene_graph
from tests.support.scenes import view as scenes


def test_poses_between_samples_are_those_of_a_run_with_more() -> None:
    run = scenes.run()
    stage = build_scene_graph(run, "between", speed=0.9)
    assert len(stage.times) == 68
    fine = scenes.model().simulate(2.0, output_times=stage.times)
    pose = stage.poses["bodies/rod"]
    assert pose.position == pytest.approx(fine.position("rod"), abs=2e-6)
    same = np.abs(np.sum(pose.quaternion * fine.orientation("rod"), axis=1))
    assert same == pytest.approx(1.0, abs=1e-6)


def test_a_tube_ends_where_the_beam_does() -> None:
    run = scenes.run()
    stage = build_scene_graph(run, "tube", most=21)
    [tube] = stage.deforming_surfaces
    around = 8
    tip = tube.vertices[:, -around:].mean(axis=1)
    fine = scenes.model().simulate(2.0, output_times=stage.times)
    assert tip == pytest.approx(fine.position("blade.tip"), abs=1e-5)
    assert np.ptp(fine.position("blade.tip"), axis=0).max() > 0.3


def test_an_exact_beam_is_its_bent_tube_alone() -> None:
    rod = {"name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0}
    rod |= {"kinematics": "exact", "modes": {"y": 3}}
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    run = mstmm.compile(mstmm.Scene(gravity=[0, -9.81, 0], beam=[rod], hinge=[pin])).simulate(0.5)
    stage = build_scene_graph(run, "exact", most=6)
    [tube] = stage.deforming_surfaces
    around = 8
    tip = tube.vertices[:, -around:].mean(axis=1)
    fine = mstmm.compile(run.model.scene).simulate(0.5, output_times=stage.times)
    assert tip == pytest.approx(fine.position("rod.tip"), abs=1e-3)
    assert not [solid for solid in stage.solids if solid.owner.startswith("bodies/rod")]


def test_springs_and_trails_meet_their_ends() -> None:
    run = scenes.run()
    stage = build_scene_graph(run, "lines", trails=("rod.tip",), most=11)
    coil, trail = stage.lines
    fine = scenes.model().simulate(2.0, output_times=stage.times)
    assert coil.points[:, 0] == pytest.approx(np.tile([0.0, 0.0, 1.0], (11, 1)), abs=1e-12)
    assert coil.points[:, -1] == pytest.approx(fine.position("rod.ear"), abs=1e-5)
    assert trail.points[0, ::4] == pytest.approx(fine.position("rod.tip"), abs=1e-5)
    assert len(trail.points_at(5, 11)) == 21


def test_bodies_with_shapes_are_drawn_by_them_alone() -> None:
    stage = build_scene_graph(scenes.run(), "shapes", most=2)
    hub = [solid for solid in stage.solids if solid.owner == "bodies/hub"]
    assert [solid.part for solid in hub] == ["case"]
    assert hub[0].colour == (0xAA, 0x33, 0x22)
    low, high = hub[0].surface.vertices.min(axis=0), hub[0].surface.vertices.max(axis=0)
    assert low == pytest.approx([-0.1, -0.15, -0.1])
    assert high == pytest.approx([0.1, 0.15, 0.3])


def test_the_box_of_equal_inertia_has_that_inertia() -> None:
    a, b, c, mass = 0.3, 0.5, 0.2, 2.0
    inertia = [
        mass / 12 * (b * b + c * c),
        mass / 12 * (a * a + c * c),
        mass / 12 * (a * a + b * b),
    ]
    body = mstmm.scene.Body(name="block", mass=mass, inertia=inertia, center_of_mass=[1, 0, 0])
    block = geometry.equal_inertia_box(body, 1.0)
    assert block is not None
    edges = np.ptp(block.vertices, axis=0)
    assert edges == pytest.approx([a, b, c])
    assert block.vertices.mean(axis=0) == pytest.approx([1, 0, 0])


def test_the_camera_sees_everything() -> None:
    stage = build_scene_graph(scenes.run(), "seen", most=11)
    look = choose_camera(stage)
    seen = (stage.cloud - look.position) @ look.axes.T
    ahead = -seen[:, 2]
    assert (ahead > 0).all()
    assert (np.abs(seen[:, 1]) <= ahead * np.tan(FIELD_OF_VIEW / 2)).all()
    assert look.axes[1] @ stage.up > 0


@pytest.mark.parametrize(
    ("lasts", "speed"), [(1e-3, 2e-4), (0.6, 0.1), (2.0, 1.0), (20.0, 1.0), (100.0, 10.0)]
)
def test_films_last_some_seconds(lasts: float, speed: float) -> None:
    assert natural_speed(lasts) == pytest.approx(speed)


def test_a_start_alone_is_one_moment() -> None:
    still = scenes.model().simulate(0.0)
    stage = build_scene_graph(still, "still")
    assert len(stage.times) == 1
    assert stage.poses["bodies/rod"].position == pytest.approx(still.position("rod")[:1])


def test_refusals() -> None:
    run = scenes.run()
    with pytest.raises(SceneError, match=r'"rod\.top": there is no such body or end.*rod\.tip'):
        build_scene_graph(run, "x", trails=("rod.top",))
    with pytest.raises(SceneError, match="the ground does not move"):
        build_scene_graph(run, "x", trails=("ground",))
    for speed in (0.0, -1.0, float("nan")):
        with pytest.raises(SceneError, match="speed"):
            run.view(speed=speed)
    with pytest.raises(SceneError, match=r"expected a name ending in \.html"):
        run.view("run.avi")


def test_many_bodies_are_seen_with_fewer_pictures() -> None:
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0, 0.084, 0.084],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    chain = {"name": "rope", "count": 600, "inboard": "ground", "end": "tip", "body": [rod],
             "hinge": [{"type": "pin", "axis": [0, 1, 0]}]}  # fmt: skip
    scene = mstmm.Scene(gravity=[0, 0, -9.81], chain=[chain])
    run = mstmm.compile(scene, engine="looped").simulate(0.2, "dopri5", rtol=1e-3)
    stage = build_scene_graph(run, "rope", speed=0.02)
    assert len(stage.times) == 150  # 301 of fewer bodies
    assert not [solid for solid in stage.solids if solid.owner.startswith("hinges/")]
    assert stage.notes == ("more than 300 hinges: they are not drawn",)
    look = choose_camera(stage)
    assert abs(look.axes[2] @ (0, 1, 0)) > 0.9  # almost along the pins


def test_a_ball_that_bounces_is_drawn_on_both_sides_of_the_blow() -> None:
    """Let go at 2 m, thrown back by 0.8 of its speed: y = 2 - g t^2 / 2, then up from the floor."""
    scene = mstmm.Scene(
        gravity=[0, -9.81, 0],
        body=[{"name": "ball", "mass": 0.2, "inertia": [1e-4, 1e-4, 1e-4]}],
        hinge=[{"name": "fall", "type": "prismatic", "inboard": "ground", "outboard": "ball",
                "axis": [0, 1, 0], "initial": {"q": [2.0]}}],
        event=[{"when": "ball.y <= 0", "do": "bounce", "restitution": 0.8}],
    )  # fmt: skip
    stage = build_scene_graph(
        mstmm.compile(scene, engine="looped").simulate(1.0), "ball", speed=0.1
    )
    blow = np.sqrt(4 / 9.81)
    after = stage.times - blow
    rising = 0.8 * 9.81 * blow * after - 9.81 * after**2 / 2
    expected = np.where(after < 0, 2 - 9.81 * stage.times**2 / 2, rising)
    assert stage.poses["bodies/ball"].position[:, 1] == pytest.approx(expected, abs=1e-9)


def test_an_elastic_body_is_seen_by_its_mesh() -> None:
    link = {"name": "link", "box": {"size": [0.5, 0.04, 0.04], "divisions": [4, 1, 1]},
            "young": 2e7, "density": 1000.0, "poisson": 0.3, "modes": 1,
            "ends": {"root": {"plane": [1, 0, 0, 0]},
                     "tip": {"plane": [1, 0, 0, 0.5]}}}  # fmt: skip
    pin = {"name": "pin", "type": "pin", "axis": [0, 1, 0], "inboard": "ground",
           "outboard": "link.root"}  # fmt: skip
    scene = mstmm.Scene(
        gravity=[0, 0, -9.81], elastic=[link], hinge=[pin],
        load=[{"on": "link.tip", "force": ["20*t", 0, "-60*t"], "axes": "body"}],
    )  # fmt: skip
    model = mstmm.compile(scene, engine="looped")
    run = model.simulate(0.2, output_times=[0, 0.1, 0.2])
    stage = build_scene_graph(run, "link", most=3)
    [seen] = [bent for bent in stage.deforming_surfaces if bent.name == "elastic/link"]
    a, b, c = np.moveaxis(seen.vertices[0][seen.faces], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(0.5 * 0.04**2)
    assert np.ptp(seen.vertices[0], axis=0) == pytest.approx([0.5, 0.04, 0.04])
    skin = model.flexible_bodies["link"].skin
    assert skin is not None
    bent = seen.vertices - run.position("link")[:, None]
    bent = np.einsum("fji,fnj->fni", stage.poses["bodies/link"].rotation(), bent) - skin.nodes
    assert np.abs(bent[-1]).max() > 1e-3
    sum_of_shapes = np.einsum("cNn,fn->fNc", skin.phi, run.coordinates("link"))
    assert bent == pytest.approx(sum_of_shapes, abs=1e-12)
    corners = skin.nodes[:, 0] > 0.4999
    corners &= (np.abs(np.abs(skin.nodes[:, 1:] - 0.02) - 0.02) < 1e-9).all(axis=1)
    tip = seen.vertices[:, corners].mean(axis=1)  # second-order displacements are not drawn
    assert tip == pytest.approx(run.position("link.tip"), abs=2e-4)


def test_many_nodes_are_seen_by_some() -> None:
    fine = {"name": "block", "box": {"size": [1, 1, 1], "divisions": [14, 14, 14]}, "order": 1,
            "young": 2e7, "density": 1000.0, "poisson": 0.3, "modes": 1,
            "ends": {"root": {"plane": [1, 0, 0, 0]}}}  # fmt: skip
    elastic = mstmm.Scene(
        gravity=[0, 0, 0], elastic=[fine],
        hinge=[{"name": "pin", "type": "pin", "inboard": "ground", "outboard": "block.root"}],
    ).elastic[0]  # fmt: skip
    model = elastic_model(elastic)
    assert model.faces is not None
    assert len(np.unique(model.faces)) == 6 * 14 * 14 + 2
    seen = skin(model, np.zeros((3 * len(model.nodes), 1)))
    assert 300 < len(seen.nodes) <= MAX_NODES
    a, b, c = np.moveaxis(seen.nodes[seen.faces], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(1.0, rel=0.15)


@pytest.mark.parametrize("size", [1e-3, 1e4])
def test_pages_of_small_and_large_scenes_are_drawn_at_a_size_that_is_seen(size: float) -> None:
    stage = build_scene_graph(scenes.run(), "x", most=3).with_scale(size)
    again = stage.with_scale(10.0 / stage.size)
    assert again.size == pytest.approx(10.0)
    pose, other = stage.poses["bodies/rod"], again.poses["bodies/rod"]
    assert other.position / again.size == pytest.approx(pose.position / stage.size)
    assert again.labels["bodies/rod"].values is stage.labels["bodies/rod"].values


def test_the_rail_of_a_slide_stays_behind() -> None:
    scene = mstmm.Scene(
        gravity=[0, 0, 0], body=[{"name": "cart", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}],
        hinge=[{"name": "rail", "type": "prismatic", "inboard": "ground", "outboard": "cart",
                "axis": [1, 0, 0], "position": [0, 1, 0], "initial": {"u": [1.0]}}],
    )  # fmt: skip
    stage = build_scene_graph(mstmm.compile(scene, engine="looped").simulate(2.0), "slide")
    assert stage.poses["hinges/rail"].position == pytest.approx(np.tile([0.0, 1, 0], (61, 1)))
    assert stage.poses["bodies/cart"].position[-1] == pytest.approx([2, 1, 0])


def test_wrong_kinds_of_arguments(tmp_path: Path) -> None:
    run = scenes.run()
    with pytest.raises(SceneError, match=r"trails = \[3\]: expected a list of names"):
        run.view(trails=[3])  # type: ignore[list-item]
    view = run.view(trails="rod.tip", speed=20.0)
    assert [line.name for line in view.stage.lines if line.name.startswith("trails")] == [
        "trails/rod.tip"
    ]
    with pytest.raises(SceneError, match="expected the name of a file"):
        view.save("")
    with pytest.raises(SceneError, match="moments = 0"):
        view.save(tmp_path / "a.png", moments=0)
    with pytest.raises(EnvironmentFailure, match="cannot be written"):
        view.save(tmp_path / "missing" / "a.png")
