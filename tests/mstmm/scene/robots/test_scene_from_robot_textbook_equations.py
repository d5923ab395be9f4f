"""Small robots on both engines, against the equations that textbooks have for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.array_validation import Array
from tests.mstmm.scene.robots.test_urdf import write_robot_file

#: A cart on a rail along x, and on it a pole about y that hangs down at 0.
CART = """<robot name="cart"><link name="base"/>
  <joint name="rail-x" type="prismatic"><parent link="base"/><child link="cart"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="9" velocity="9"/>
    <dynamics damping="0.3"/></joint>
  <link name="cart"><inertial><mass value="1.5"/>
    <inertia ixx="0.1" iyy="0.2" izz="0.1"/></inertial></link>
  <joint name="pole-y" type="continuous"><parent link="cart"/><child link="pole"/>
    <axis xyz="0 -1 0"/></joint>
  <link name="pole"><inertial><origin xyz="0 0 -0.4"/><mass value="0.3"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.001"/></inertial></link></robot>"""

#: Two links in the plane of x and z, each along x at 0, about -y: angles grow upwards.
ARM = """<robot name="arm"><link name="base"/>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/>
    <axis xyz="0 -1 0"/></joint>
  <link name="upper"><inertial><origin xyz="0.25 0 0"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.05" izz="0.05"/></inertial></link>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.6 0 0"/><axis xyz="0 -1 0"/></joint>
  <link name="fore"><inertial><origin xyz="0.2 0 0"/><mass value="1.1"/>
    <inertia ixx="0.01" iyy="0.03" izz="0.03"/></inertial></link></robot>"""


def of_cart(q: Array, u: Array) -> Array:
    """Cart and pole: M udot = h, with the pole's mass centre at x + l sin(angle), -l cos(angle)."""
    cart, m, length, inertia = 1.5, 0.3, 0.4, 0.02
    sine, cosine = np.sin(q[1]), np.cos(q[1])
    mass = [[cart + m, m * length * cosine], [m * length * cosine, inertia + m * length**2]]
    acts = [m * length * sine * u[1] ** 2 - 0.3 * u[0], -m * 9.81 * length * sine]
    return np.linalg.solve(mass, acts)


def of_arm(q: Array, u: Array) -> Array:
    """Spong, Hutchinson, Vidyasagar: Robot Modeling and Control, planar elbow manipulator."""
    m1, m2, l1, r1, r2, i1, i2, g = 2.0, 1.1, 0.6, 0.25, 0.2, 0.05, 0.03, 9.81
    cosine, h = np.cos(q[1]), -m2 * l1 * r2 * np.sin(q[1])
    d11 = m1 * r1**2 + m2 * (l1**2 + r2**2 + 2 * l1 * r2 * cosine) + i1 + i2
    d12, d22 = m2 * (r2**2 + l1 * r2 * cosine) + i2, m2 * r2**2 + i2
    fore = m2 * r2 * g * np.cos(q[0] + q[1])
    weights = [(m1 * r1 + m2 * l1) * g * np.cos(q[0]) + fore, fore]
    turning = [h * u[1] * (2 * u[0] + u[1]), -h * u[0] ** 2]
    return np.linalg.solve([[d11, d12], [d12, d22]], -np.array(turning) - weights)


@pytest.mark.parametrize("engine", ["fused", "looped"])
@pytest.mark.parametrize(("text", "wanted"), [(CART, of_cart), (ARM, of_arm)], ids=["cart", "arm"])
def test_accelerations_are_those_of_textbooks(
    engine: str, text: str, wanted: object, tmp_path: Path, rng: np.random.Generator
) -> None:
    assert callable(wanted)
    model = mstmm.compile(mstmm.load_scene(write_robot_file(tmp_path, text)), engine=engine)
    for q, u in rng.uniform(-2, 2, (20, 2, 2)):
        assert model.accelerations(q, u) == pytest.approx(wanted(q, u), rel=1e-12, abs=1e-12)
