"""Robots that are published, and what MJCF can say, against Pinocchio and MuJoCo."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import mstmm
from mstmm.scene.robots.mjcf import read_mjcf
from mstmm.scene.robots.scene_from_robot import ImportedRobot, ImportOptions, scene_from_robot
from mstmm.scene.robots.unit_conversion import Units, convert_units
from tests.support.peers.robot_pairs import (
    Pair,
    import_robot,
    pairs,
    relative_difference,
    urdf_files,
)

#: Speeds of robots whose derivatives are compared: those of larger ones take long to prepare, so of
#: them a few stand for all.
MOST = 18
LARGER = ("talos_reduced.urdf", "romeo_small.urdf", "g1_29dof_rev_1_0.urdf", "human.urdf")


def package_differences(package: str) -> dict[str, dict[str, float]]:
    """Robot and base -> how far ours and Pinocchio's differ, in parts of the largest number; what
    solves with the mass matrix beside its condition."""
    return {
        name: differences(pair, pair.model.nu <= MOST or name.split()[0].endswith(LARGER))
        for name, pair in pairs(package)
    }


def differences(pair: Pair, rates_too: bool) -> dict[str, float]:
    model, peer, data = pair.model, pair.peer, pair.data
    ours, theirs, whole = pair.ours, pair.theirs, pair.mass()
    both, given = np.ix_(theirs, theirs), (pair.q, pair.u)
    solved = max(1.0, float(np.linalg.cond(whole)) / 1e5)
    rates = np.zeros(model.nu)
    rates[ours] = pair.speeds[theirs]  # any accelerations will do; the base has none
    asked = pin.rnea(peer, data, pair.at, pair.speeds, pair.speeds)[theirs]
    wanted = pin.aba(peer, data, pair.at, pair.speeds, pair.pushes)[theirs]
    return {
        "accelerations": relative_difference(
            model.accelerations(*given, efforts=pair.efforts)[ours], wanted
        )
        / solved,
        "efforts": relative_difference(model.inverse_dynamics(*given, rates)[ours], asked),
        "mass matrix": relative_difference(
            model.mass_matrix(pair.q)[np.ix_(ours, ours)], whole[both]
        ),
        "frames": frames(pair),
        "bias": relative_difference(
            model.bias_efforts(*given)[ours],
            pin.nonLinearEffects(peer, data, pair.at, pair.speeds)[theirs],
        ),
        **moving(pair),
        **({"derivatives": derivatives(pair) / solved} if rates_too else {}),
    }


def moving(pair: Pair) -> dict[str, float]:
    """Motions of the last link by all speeds, their rates, and what holds against gravity."""
    peer, data, aligned = pair.peer, pair.data, pin.LOCAL_WORLD_ALIGNED
    ours, theirs = pair.speeds_of_all()
    gravity = pin.computeGeneralizedGravity(peer, data, pair.at)[theirs]
    pin.computeJointJacobiansTimeVariation(peer, data, pair.at, pair.speeds)
    pin.updateFramePlacements(peer, data)
    name = next(
        frame.name for frame in reversed(peer.frames)
        if frame.type == pin.FrameType.BODY and pair.one.links.get(frame.name, "ground") != "ground"
    )  # fmt: skip
    frame, of = peer.getFrameId(name), pair.one.links[name]
    rows, rates = (
        found(peer, data, frame, aligned).reshape(6, -1)[:, theirs]  # of one joint they are flat
        for found in (pin.getFrameJacobian, pin.getFrameJacobianTimeVariation)
    )
    return {
        "gravity": relative_difference(pair.model.gravity_efforts(pair.q)[ours], gravity),
        "Jacobian": relative_difference(pair.model.jacobian(pair.q, of)[:, ours], rows),
        "its rate": relative_difference(
            pair.model.jacobian_rate(pair.q, pair.u, of)[:, ours], rates
        ),
    }


def derivatives(pair: Pair) -> float:
    """Of the accelerations by q and u."""
    pin.computeABADerivatives(pair.peer, pair.data, pair.at, pair.speeds, pair.pushes)
    found = pair.model.derivatives(pair.q, pair.u, efforts=pair.efforts)
    ours, theirs = np.ix_(pair.ours, pair.ours), np.ix_(pair.theirs, pair.theirs)
    by_q, by_u = pair.data.ddq_dq[theirs], pair.data.ddq_dv[theirs]
    return max(relative_difference(found.q[ours], by_q), relative_difference(found.u[ours], by_u))


def frames(pair: Pair) -> float:
    """Places and axes of all links."""
    pin.framesForwardKinematics(pair.peer, pair.data, pair.at)
    run, worst = pair.model.simulate(0.0, initial=(pair.q, pair.u)), 0.0
    for frame, place in zip(pair.peer.frames, pair.data.oMf, strict=True):
        name = pair.one.links.get(frame.name, "ground")
        if frame.type == pin.FrameType.BODY and name != "ground":
            x, y, z, w = pin.Quaternion(place.rotation).coeffs()
            turned = run.orientation(name)[0]
            turned = turned * np.sign(turned @ [w, x, y, z])
            worst = max(
                worst, relative_difference(run.position(name)[0], place.translation),
                relative_difference(turned, np.array([w, x, y, z])),
            )  # fmt: skip
    return worst


@pytest.mark.parametrize(
    ("package", "robots", "derived", "larger"),
    [("example-robot-data", 60, 40, LARGER), ("pybullet", 70, 70, ())],
)
def test_published_robots_move_as_pinocchio_has_them(
    package: str, robots: int, derived: int, larger: tuple[str, ...]
) -> None:
    found = package_differences(package)
    far = {name: apart for name, apart in found.items() if not max(apart.values()) < 1e-11}
    assert far == {}
    assert len({name.split()[0] for name in found}) >= robots
    with_rates = {name.split()[0] for name, apart in found.items() if "derivatives" in apart}
    assert len(with_rates) >= derived
    assert {name.rpartition("/")[2] for name in with_rates} >= set(larger)


MACHINE = """
<mujoco>
  <option gravity="0.3 0 -9.6"/>
  <worldbody>
    <body name="cart" pos="0 0 1" quat="1 0.2 0 0.1">
      <joint name="rail" type="slide" axis="1 0.5 0" damping="0.3" ref="0.2"/>
      <joint name="swing" axis="0 1 0" pos="0.1 0 0.2" armature="0.05" stiffness="3"
             springref="0.4"/>
      <joint name="lean" axis="1 0 0" pos="0 0.1 0" ref="0.5"/>
      <geom type="box" size="0.2 0.1 0.3" mass="3" pos="0.05 0 0" euler="10 20 30"/>
      <body name="plate" pos="0.2 0 0"><geom type="sphere" size="0.1" mass="1"/>
        <body name="ball" pos="0 0 -0.3">
          <joint name="socket" type="ball" pos="0 0.05 0.1" damping="0.02"/>
          <geom type="capsule" size="0.05 0.2" mass="0.7" pos="0.1 0 0"/>
        </body>
      </body>
    </body>
    <body name="bird" pos="3 0 0"><freejoint name="sky"/>
      <geom type="cylinder" size="0.1 0.3" mass="2" pos="0 0.1 0"/>
      <body name="wing" pos="0.1 0 0"><joint name="flap" axis="1 0 0"/>
        <geom type="box" size="0.3 0.1 0.01" mass="0.2" pos="0 0.2 0"/></body>
    </body>
  </worldbody>
</mujoco>
"""


def machine(tmp_path: Path, text: str = MACHINE) -> tuple[Path, ImportedRobot]:
    path = tmp_path / "machine.xml"
    path.write_text(text)
    return path, scene_from_robot(read_mjcf(str(path), path.name), ImportOptions())


def states(one: ImportedRobot, model: mstmm.Model, peer: Any, rng: np.random.Generator) -> Any:
    """The same state for both, the base of what flies at rest, and the places of its speeds."""
    data = mujoco.MjData(peer)
    at, speeds = np.array(peer.qpos0), rng.uniform(-1, 1, peer.nv)
    mujoco.mj_integratePos(peer, at, rng.uniform(-1, 1, peer.nv), 1.0)
    q, u, ours, theirs = np.zeros(model.nq), np.zeros(model.nu), list[int](), list[int]()
    for joint in range(peer.njnt):
        slots = model.coordinate_layout.hinges[one.names[peer.joint(joint).name]]
        a, v = int(peer.jnt_qposadr[joint]), int(peer.jnt_dofadr[joint])
        q[slots.q : slots.q + slots.nq] = at[a : a + slots.nq]
        if slots.nu == 6:
            speeds[v : v + 6] = 0.0
            continue
        u[slots.u : slots.u + slots.nu] = speeds[v : v + slots.nu]
        ours += range(slots.u, slots.u + slots.nu)
        theirs += range(v, v + slots.nu)
    data.qpos[:], data.qvel[:] = at, speeds
    mujoco.mj_forward(peer, data)
    return q, u, data, ours, theirs


def test_joints_in_a_row_anchors_and_references_as_mujoco_has_them(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    path, one = machine(tmp_path)
    peer, model = mujoco.MjModel.from_xml_path(str(path)), mstmm.compile(one.scene)
    q, u, data, ours, theirs = states(one, model, peer, rng)
    got, wanted = model.accelerations(q, u)[ours], data.qacc[theirs]
    assert got == pytest.approx(wanted, rel=1e-11, abs=1e-11 * np.abs(wanted).max())
    place = mstmm.compile(one.scene).simulate(0.0, initial=(q, u)).position
    for name in ("cart", "plate", "ball", "wing"):
        frame = one.names.get(f"{name}/frame", one.names[name])
        assert place(frame)[0] == pytest.approx(data.body(name).xpos, abs=1e-12)


def test_other_units_only_scale_what_has_lengths(tmp_path: Path, rng: np.random.Generator) -> None:
    path, one = machine(tmp_path)
    robot = convert_units(read_mjcf(str(path), path.name), Units(1e-3, 2e-3), gravity=True)
    peer, model = mujoco.MjModel.from_xml_path(str(path)), mstmm.compile(one.scene)
    q, u, data, ours, theirs = states(one, model, peer, rng)
    rail, sky = (model.coordinate_layout.hinges[one.names[name]] for name in ("rail", "sky"))
    q[rail.q] *= 1e-3
    u[rail.u] *= 1e-3
    q[sky.q : sky.q + 3] *= 1e-3
    got = mstmm.compile(scene_from_robot(robot, ImportOptions()).scene).accelerations(q, u)
    got[rail.u] *= 1e3
    wanted = data.qacc[theirs]
    assert got[ours] == pytest.approx(wanted, rel=1e-10, abs=1e-10 * np.abs(wanted).max())


def test_loading_takes_units_of_mjcf_too(tmp_path: Path) -> None:
    path, units = machine(tmp_path)[0], {"length": "in", "mass": "lb"}
    found = mstmm.load_scene(path, units=units)
    assert found == mstmm.import_robot(path, units=units).scene != mstmm.load_scene(path)


def test_it_runs_as_mujoco_runs_it(tmp_path: Path) -> None:
    path, one = machine(tmp_path)
    peer = mujoco.MjModel.from_xml_path(str(path))
    peer.opt.integrator, peer.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 1e-3
    peer.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(peer)
    while data.time < 0.4 - 1e-9:
        mujoco.mj_step(peer, data)
    mujoco.mj_forward(peer, data)
    model = mstmm.compile(one.scene)
    result = model.simulate(0.4, rtol=1e-11, atol=1e-12)
    for name in ("cart", "ball", "wing"):
        frame = one.names.get(f"{name}/frame", one.names[name])
        assert result.position(frame)[-1] == pytest.approx(data.body(name).xpos, abs=1e-9)


def test_equalities_of_joints_become_couplings_and_the_rest_is_told(tmp_path: Path) -> None:
    extra = """<equality><joint joint1="swing" joint2="lean" polycoef="0.1 2 0 0 0"/>
      <weld body1="bird" body2="cart"/></equality>
      <actuator><motor joint="flap"/></actuator>
      <keyframe><key name="home" qpos="0.1"/></keyframe></mujoco>"""
    _, one = machine(tmp_path, MACHINE.replace("</mujoco>", extra))
    (coupling,) = one.scene.coupling
    assert [name.text for name in coupling.names] == ["swing.q", "lean.q"]
    told = [f"{note.element}: {note.text}" for note in one.notes]
    assert "equality 'equality1' (weld): left out" in told
    assert "actuators: left out, 1 of them" in told
    assert "keyframes: left out, 1 of them" in told


def test_what_of_mjcf_is_left_out_is_told_by_name_and_line(tmp_path: Path) -> None:
    extra = """
      <equality><connect name="hold" body1="bird" body2="cart" anchor="0 0 0"/>
        <joint name="bent" joint1="lean" polycoef="0 1 2 0 0"/></equality>
      <tendon><fixed name="cord"><joint joint="flap" coef="1"/></fixed></tendon>
      <contact><exclude name="apart" body1="bird" body2="cart"/></contact></mujoco>"""
    text = MACHINE.replace('name="flap"', 'name="flap" actuatorfrcrange="-2 3"')
    path, _ = machine(tmp_path, text.replace("</mujoco>", extra))
    told = [str(note).removeprefix(f"{path}: ") for note in mstmm.import_robot(path).notes]
    assert "line 25: equality 'hold' (connect): left out" in told
    assert "line 26: equality 'bent' (joint): left out" in told
    assert "line 27: tendon 'cord': left out" in told
    assert "line 28: exclude 'apart': left out" in told
    assert "line 20: joint 'flap': actuatorfrcrange from -2 to 3 left out" in told
    rows = "its 3 joints are hinges in series, with massless bodies between them"
    assert f"line 5: body 'cart': {rows}" in told
    assert "line 12: body 'ball': its origin is at its joint; its original frame is an end" in told


def test_what_mujoco_refuses_is_refused_in_one_message(tmp_path: Path) -> None:
    path = tmp_path / "machine.xml"
    path.write_text("<mujoco><worldbody><body><joint type='spring'/></body></worldbody></mujoco>")
    with pytest.raises(mstmm.SceneError, match="MuJoCo cannot read the file"):
        mstmm.import_robot(path)
    path.write_text(MACHINE)
    with pytest.raises(mstmm.SceneError, match="in MJCF use a <freejoint>"):
        mstmm.import_robot(path, base="free")


@pytest.mark.parametrize("name", ["ur5_robot.urdf", "panda.urdf", "go2.urdf"])
def test_others_read_what_is_exported(name: str, rng: np.random.Generator) -> None:
    """Pinocchio has the same accelerations from our file as from the published one; MuJoCo reads it
    too."""
    path = next(path for path in urdf_files() if path.name == name)
    text = mstmm.export_robot(import_robot(path, "fixed").scene).text
    first, again = pin.buildModelFromUrdf(str(path)), pin.buildModelFromXML(text)
    q, v = pin.neutral(again), rng.uniform(-1, 1, again.nv)
    at = pin.neutral(first)
    places = [(first.getJointId(n), again.getJointId(n)) for n in list(first.names)[1:]]
    at_v = np.zeros(first.nv)
    for one, other in places:
        angle = rng.uniform(-1, 1)
        circle = np.array([np.cos(angle), np.sin(angle)])
        for model, k, where in ((first, one, at), (again, other, q)):
            width = model.nqs[k]
            where[model.idx_qs[k] : model.idx_qs[k] + width] = circle if width == 2 else angle
        at_v[first.idx_vs[one]] = v[again.idx_vs[other]]
    wanted = pin.aba(first, first.createData(), at, at_v, np.zeros(first.nv))
    found = pin.aba(again, again.createData(), q, v, np.zeros(again.nv))
    for one, other in places:
        assert found[again.idx_vs[other]] == pytest.approx(
            wanted[first.idx_vs[one]], rel=1e-11, abs=1e-11 * np.abs(wanted).max()
        )
    assert mujoco.MjModel.from_xml_string(text).nv == again.nv
