"""Joints that go with others: coupled, or held where they start."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.scene.robots.robot_model import Joint, Link, Mimic, Robot
from mstmm.scene.robots.scene_from_robot import ImportOptions, scene_from_robot
from tests.mstmm.scene.robots.test_urdf import ARM, write_robot_file

_UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def chain(*joints: Joint, mimics: tuple[Mimic, ...]) -> Robot:
    """Links of 1 kg in a row, each on a joint of its own, in the order of the joints."""
    names = [joint.child for joint in joints]
    links = (Link("base"), *(Link(name, 1.0, inertia=_UNIT) for name in names))
    return Robot("chain", "chain.urdf", links, joints, mimics)


def pin(number: int, start: float | None = None, kind: str = "pin") -> Joint:
    """Joint number k, between the links before and at it."""
    before = "base" if number == 0 else f"link{number - 1}"
    keys: dict[str, Any] = {} if kind in ("fixed", "free") else {"axis": (0.0, 0.0, 1.0)}
    if start is not None:
        keys["initial"] = {"q": [start]}
    return Joint(f"j{number}", kind, before, f"link{number}", keys=keys)


def test_a_joint_that_mimics_may_be_held(tmp_path: Path) -> None:
    path = write_robot_file(tmp_path, ARM)
    found = mstmm.import_robot(path, mimics="held")
    assert not found.scene.coupling
    assert "held at 0.01; it mimics another" in [note.text for note in found.notes]
    run = mstmm.compile(found.scene).simulate(0.2)
    held = run.model.coordinate_layout.hinges["other_jaw"].q
    assert run.success and np.ptp(run.q[:, held]) == 0 and run.q[0, held] == 0.01
    with pytest.raises(mstmm.SceneError, match='expected "coupled" or "held", found'):
        mstmm.import_robot(path, mimics="frozen")


def test_a_joint_starts_where_the_other_one_is() -> None:
    """q = 2 q_other + 0.25, and the other one starts at 0.5, as MJCF may say."""
    robot = chain(pin(0, 0.5), pin(1, 9.0), mimics=(Mimic("j1", "j0", 2.0, 0.25),))
    coupled = scene_from_robot(robot, ImportOptions()).scene
    q = mstmm.compile(coupled, engine="looped").initial_state()[0]
    np.testing.assert_allclose(q, [0.5, 1.25], rtol=0, atol=1e-14)
    held = scene_from_robot(robot, ImportOptions(mimics="held")).scene
    assert held.hinges[1].drive is not None and held.hinges[1].initial is None
    q = mstmm.compile(held, engine="looped").initial_state()[0]
    np.testing.assert_allclose(q, [0.5, 1.25], rtol=0, atol=1e-14)


def test_what_goes_with_none_of_it_is_held() -> None:
    """q = 0 q_other + 0.25, which MJCF and URDF may say."""
    robot = chain(pin(0, 0.5), pin(1), mimics=(Mimic("j1", "j0", 0.0, 0.25),))
    found = scene_from_robot(robot, ImportOptions())
    assert not found.scene.coupling
    assert "held at 0.25; it mimics another" in [note.text for note in found.notes]
    run = mstmm.compile(found.scene, engine="looped").simulate(0.2)
    assert run.success and (run.coordinates("j1") == 0.25).all()


@pytest.mark.parametrize("merge", [True, False])
def test_what_goes_with_a_joint_that_does_not_move_is_held(merge: bool) -> None:
    robot = chain(
        pin(0, kind="fixed"), pin(1), pin(2), mimics=(Mimic("j1", "j0", 3.0, 0.25),)
    )  # fmt: skip
    found = scene_from_robot(robot, ImportOptions(merge=merge))
    assert not found.scene.coupling
    assert "held at 0.25; it mimics another" in [note.text for note in found.notes]
    run = mstmm.compile(found.scene, engine="looped").simulate(0.1)
    assert run.success and np.ptp(run.quantity("j1.q").values) == 0.0


def test_what_goes_with_several_coordinates_is_left_free() -> None:
    robot = chain(pin(0, kind="free"), pin(1), mimics=(Mimic("j1", "j0", 1.0, 0.0),))
    found = scene_from_robot(robot, ImportOptions())
    assert not found.scene.coupling and found.scene.hinges[1].drive is None
    told = "left free: it mimics 'j0', which has more than one coordinate"
    assert told in [note.text for note in found.notes]


def test_a_long_row_of_them_is_followed_to_its_end() -> None:
    count = 3000
    mimics = tuple(Mimic(f"j{k}", f"j{k - 1}", 1.0, 0.5) for k in range(1, count))
    found = scene_from_robot(
        chain(*map(pin, range(count)), mimics=mimics), ImportOptions(mimics="held")
    )
    last = found.scene.hinges[-1].drive
    assert last is not None and last[0] is not None
    assert last[0].constant == (count - 1) / 2
    ring = chain(pin(0), pin(1), mimics=(Mimic("j0", "j1", 1.0, 0.0), Mimic("j1", "j0", 1.0, 0.0)))
    with pytest.raises(mstmm.SceneError, match="joint 'j0' mimics itself through other joints"):
        scene_from_robot(ring, ImportOptions())
