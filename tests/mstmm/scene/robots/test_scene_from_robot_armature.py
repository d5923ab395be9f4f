"""Armature of a free joint: inertia at its origin that accelerates and weighs nothing."""

from __future__ import annotations

import numpy as np

import mstmm
from mstmm.scene.robots.robot_model import Joint, Link, Robot
from mstmm.scene.robots.scene_from_robot import ImportOptions, scene_from_robot


def test_it_accelerates_along_inertial_axes() -> None:
    """Newton and Euler about the origin of the body's frame with the armature on the diagonal:
    (m + A) dv + m (alpha x r + w x (w x r)) = m g, (J + A) alpha + w x J w + m r x dv = m r x g."""
    mass, armature, r, moments = 1.7, 0.3, np.array([0.1, 0.2, -0.3]), np.array([0.02, 0.03, 0.01])
    law = {"inertia": [armature] * 6}
    inertia = ((0.02, 0.0, 0.0), (0.0, 0.03, 0.0), (0.0, 0.0, 0.01))
    body = Link("a", mass, (0.1, 0.2, -0.3), inertia)
    joint = Joint("float it", "free", "world", "a", keys={"law": law, "armature": armature})
    robot = Robot("", "a.xml", (Link("world"), body), (joint,), gravity=(0.3, -0.4, -9.81))
    found = mstmm.compile(scene_from_robot(robot, ImportOptions()).scene)
    v, w = np.array([0.7, -1.1, 0.4]), np.array([1.3, 0.6, -0.9])  # in the body's axes
    gravity = np.array([0.3, -0.4, -9.81])  # the body's axes are inertial at this moment
    skew = np.cross(np.eye(3), r)  # skew y = r x y
    about_origin = np.diag(moments) + mass * (r @ r * np.eye(3) - np.outer(r, r))
    whole = np.block([
        [(mass + armature) * np.eye(3), mass * skew.T],
        [mass * skew, about_origin + armature * np.eye(3)],
    ])  # fmt: skip
    force = mass * (gravity - np.cross(w, np.cross(w, r)))
    moment = mass * np.cross(r, gravity) - np.cross(w, about_origin @ w)
    expected = np.linalg.solve(whole, [*force, *moment])
    expected[:3] -= np.cross(w, v)  # of the speeds, which are in axes that turn
    udot = found.accelerations([0, 0, 0, 1, 0, 0, 0], [*v, *w])
    np.testing.assert_allclose(udot, expected, rtol=1e-13)
