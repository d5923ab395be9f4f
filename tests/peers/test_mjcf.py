"""Robots in MJCF that the packages dm_control and pybullet ship, against MuJoCo."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.metadata import files
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import mstmm
from mstmm.scene.robots.mjcf import read_mjcf
from mstmm.scene.robots.scene_from_robot import ImportedRobot, ImportOptions, scene_from_robot
from tests.peers.test_robots import states
from tests.support.peers.robot_pairs import of_peers, relative_difference

#: Folders of each package with whole robots.
FOLDERS = {
    "dm-control": tuple(f"dm_control/{inside}" for inside in (
        "suite/", "locomotion/walkers/assets/", "locomotion/soccer/", "third_party/")),
    "pybullet": ("pybullet_data/mjcf/",),
}  # fmt: skip
#: What of MuJoCo's forces a scene has not; <flag> in a file may switch off more.
OFF = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_ACTUATION


def mjcf_files() -> Iterator[Path]:
    """Files that MuJoCo reads by themselves and in which something moves."""
    for package, folders in FOLDERS.items():
        for one in files(package) or ():
            if one.suffix != ".xml" or not one.as_posix().startswith(folders):
                continue
            path = Path(str(one.locate()))
            try:
                model = mujoco.MjModel.from_xml_path(str(path))
            except ValueError:  # a part of another file, or one of an older MuJoCo
                continue
            if model.nv and all(model.joint(k).name for k in range(model.njnt)):
                yield path


def links_only_model(path: Path) -> Any:
    """MuJoCo's model with the motion of links alone: no tendons, fluids, friction and lifts, and no
    springs of balls, all of which our scenes are told to lack."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= int(OFF)
    model.opt.density = model.opt.viscosity = 0.0
    for array in (model.dof_frictionloss, model.body_gravcomp, model.tendon_stiffness,
                  model.tendon_damping, model.tendon_armature):  # fmt: skip
        array[:] = 0.0
    model.jnt_stiffness[model.jnt_type < int(mujoco.mjtJoint.mjJNT_SLIDE)] = 0.0
    return model


def of_links(path: Path) -> ImportedRobot:
    """Our scene with the same."""
    robot = of_peers(read_mjcf(str(path), path.name), "damping", "inertia", "stiffness", "rest")
    return scene_from_robot(robot, ImportOptions())


def differences(path: Path, rng: np.random.Generator) -> dict[str, float]:
    """How far ours and MuJoCo's differ, in parts of the largest number."""
    peer, one = links_only_model(path), of_links(path)
    model = mstmm.compile(one.scene)
    q, u, data, ours, theirs = states(one, model, peer, rng)
    both, whole = np.ix_(ours, ours), np.zeros((peer.nv, peer.nv))
    mujoco.mj_fullM(peer, data, whole)
    found = {
        "accelerations": relative_difference(model.accelerations(q, u)[ours], data.qacc[theirs]),
        "mass matrix": relative_difference(
            model.mass_matrix(q)[both], whole[np.ix_(theirs, theirs)]
        ),
    }
    udot, data.qacc[:] = np.zeros(model.nu), 0.0
    udot[ours] = data.qacc[theirs] = rng.uniform(-1, 1, len(ours))
    mujoco.mj_inverse(peer, data)
    found["efforts"] = relative_difference(
        model.inverse_dynamics(q, u, udot)[ours], data.qfrc_inverse[theirs]
    )
    for number in range(1, peer.nbody):
        name = peer.body(number).name
        of = one.links.get(f"{name}/frame", one.links.get(name, "ground"))
        if of == "ground":
            continue
        rows = np.zeros((6, peer.nv))
        mujoco.mj_jacBody(peer, data, rows[:3], rows[3:], number)
        found[f"place of {name}"] = relative_difference(model.positions(q, of), data.xpos[number])
        found[f"J of {name}"] = relative_difference(model.jacobian(q, of)[:, ours], rows[:, theirs])
    return found


def test_published_robots_move_as_mujoco_has_them() -> None:
    rng = np.random.default_rng(16)
    found = {
        path.relative_to(path.parents[2]).as_posix(): differences(path, rng)
        for path in mjcf_files()
    }
    assert len(found) >= 36
    far = {name: one for name, one in found.items() if not max(one.values()) < 1e-11}
    assert far == {}


@pytest.mark.parametrize("name", ["cheetah.xml", "walker.xml", "pusher.xml"])
def test_steps_of_rk4_are_mujocos(name: str, rng: np.random.Generator) -> None:
    """The same method with the same steps gives the same numbers, but for rounding."""
    path, step, steps = next(path for path in mjcf_files() if path.name == name), 1e-3, 200
    peer, one = links_only_model(path), of_links(path)
    peer.opt.integrator, peer.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, step
    model = mstmm.compile(one.scene)
    q, u, data, ours, theirs = states(one, model, peer, rng)
    for _ in range(steps):
        mujoco.mj_step(peer, data)
    run = model.simulate(step * steps, "rk4", step, initial=(q, u))
    assert run.success and model.nq == model.nu == peer.nv == len(ours)
    for found, wanted in ((run.q, data.qpos), (run.u, data.qvel)):
        assert relative_difference(found[-1][ours], wanted[theirs]) < 1e-11


#: Weights of a central difference of fourth order, at steps of these sizes.
STENCIL = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}


def slopes(peer: Any, data: Any, places: list[int], by: str, step: float) -> Any:
    """Differences of MuJoCo's accelerations by coordinates or speeds, of these places each."""
    at, speeds, columns = data.qpos.copy(), data.qvel.copy(), list[Any]()
    for place in places:
        column = np.zeros(peer.nv)
        for steps, weight in STENCIL.items():
            moved, way = at.copy(), np.zeros(peer.nv)
            way[place] = 1.0
            if by == "q":
                mujoco.mj_integratePos(peer, moved, way, steps * step)
            data.qpos[:], data.qvel[:] = moved, speeds + (steps * step * way if by == "u" else 0)
            mujoco.mj_forward(peer, data)
            column += weight / step * data.qacc
        columns.append(column[places])
    data.qpos[:], data.qvel[:] = at, speeds
    return np.array(columns).T


@pytest.mark.parametrize("name", ["cheetah.xml", "walker.xml", "pusher.xml", "humanoid.xml"])
def test_exact_derivatives_are_the_slopes_of_mujocos_accelerations(
    name: str, rng: np.random.Generator
) -> None:
    """As near as its differences by two steps are to each other."""
    path = next(path for path in mjcf_files() if path.name == name)
    peer, one = links_only_model(path), of_links(path)
    model = mstmm.compile(one.scene)
    q, u, data, ours, theirs = states(one, model, peer, rng)
    found, both = model.derivatives(q, u), np.ix_(ours, ours)
    for by, exact in (("q", found.q[both]), ("u", found.u[both])):
        rough, fine = (slopes(peer, data, theirs, by, step) for step in (2e-3, 1e-3))
        between = relative_difference(rough, fine)
        assert between < 1e-8
        assert relative_difference(exact, fine) < max(1e-10, between)


FLAGS = """<mujoco><option><flag {}/></option><worldbody><body>
  <joint name="swing" axis="0 1 0" damping="0.3" stiffness="2" springref="0.4"/>
  <geom type="box" size="0.1 0.2 0.3" mass="2" pos="0.2 0 0.1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("off", ["gravity", "spring", "damper"])
def test_what_a_file_switches_off_is_off(off: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(FLAGS.format(f'{off}="disable"'))
    peer = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(peer)
    data.qpos[:], data.qvel[:] = 0.3, 0.7
    mujoco.mj_forward(peer, data)
    found = mstmm.compile(mstmm.load_scene(path)).accelerations([0.3], [0.7])
    assert found == pytest.approx(data.qacc, rel=1e-12)


COUPLED = """<mujoco><option><flag {flag}/></option><worldbody><body>
  <joint name="swing" axis="0 1 0" frictionloss="0.4"/>
  <geom type="box" size="0.1 0.2 0.3" mass="2" pos="0.2 0 0.1"/><body pos="0.4 0 0">
  <joint name="elbow" axis="0 1 0"/><geom type="box" size="0.1 0.1 0.3" pos="0.2 0 0" mass="1"/>
  </body></body></worldbody>
  <equality><joint joint1="elbow" joint2="swing" {active} polycoef="0 2 0 0 0"/></equality>
</mujoco>"""


@pytest.mark.parametrize(
    ("flag", "active"),
    [
        ('constraint="disable"', ""),
        ('equality="disable" frictionloss="disable" contact="disable"', ""),
        ('frictionloss="disable" contact="disable"', 'active="false"'),
    ],
)
def test_equalities_that_are_off(flag: str, active: str, tmp_path: Path) -> None:
    """They couple nothing, and a note tells of them."""
    path = tmp_path / "robot.xml"
    path.write_text(COUPLED.format(flag=flag, active=active))
    peer = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(peer)
    data.qpos[:], data.qvel[:] = [0.3, 0.1], [0.7, -0.2]
    mujoco.mj_forward(peer, data)
    robot = mstmm.import_robot(path)
    assert any(note.text == "left out: switched off" for note in robot.notes)
    found = mstmm.compile(robot.scene).accelerations(data.qpos, data.qvel)
    assert found == pytest.approx(data.qacc, rel=1e-12)


CURVED = """<mujoco><worldbody><body><joint name="swing" axis="0 1 0" stiffness="{}" damping="{}"/>
  <geom type="box" size="0.1 0.2 0.3" mass="2" pos="0.2 0 0.1"/></body></worldbody></mujoco>"""


@pytest.mark.skipif(
    not hasattr(mujoco.MjModel, "jnt_stiffnesspoly"), reason="this MuJoCo has straight lines alone"
)
@pytest.mark.parametrize(
    ("stiffness", "damping", "told"), [("2 0.3", "1", "spring"), ("2", "1 0 0.1", "damper")]
)
def test_curves_of_springs_and_dampers_are_told(
    stiffness: str, damping: str, told: str, tmp_path: Path
) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(CURVED.format(stiffness, damping))
    notes = [note.text for note in mstmm.import_robot(path).notes if "nonlinear terms" in note.text]
    assert notes == [f"the nonlinear terms of its {told} are left out"]


def test_armature_of_a_free_joint(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(
        '<mujoco><worldbody><body name="a"><joint name="f" type="free" armature="0.3"/>'
        '<inertial pos="0.1 0.2 -.3" mass="1" diaginertia=".02 .03 .01"/></body></worldbody>'
        "</mujoco>"
    )
    peer = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(peer)
    data.qvel[:] = [0.7, -1.1, 0.4, 1.3, 0.6, -0.9]
    mujoco.mj_forward(peer, data)
    found = mstmm.compile(mstmm.load_scene(path)).accelerations(data.qpos, data.qvel)
    found[:3] += np.cross(data.qvel[3:], data.qvel[:3])  # of speeds in axes that turn
    assert found == pytest.approx(data.qacc, rel=1e-12)
