"""Stewart platform of the examples in MuJoCo, with five balls as equality constraints."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

import mstmm


def _text(numbers: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in numbers)


def _inertial(height: float, mass: float, moments: str) -> str:
    return f'<inertial pos="0 0 {height}" mass="{mass}" diaginertia="{moments}"/>'


class MujocoPlatform:
    """The bodies at the initial state of a model, where all coordinates of MuJoCo are zero."""

    def __init__(self, model: mstmm.Model) -> None:
        self.start, self.layout = model.simulate(0.0), model.coordinate_layout
        platform = next(body for body in model.scene.body if body.name == "platform")
        self.head_positions = [np.array(platform.ends[f"head{k}"].position) for k in range(6)]
        free_lengths = [h.law.rest for h in model.scene.hinge if h.type == "prismatic" and h.law]
        legs = [self._leg_text(k, float(np.ravel(free_lengths[k])[0])) for k in range(6)]
        rows = [
            f'<connect body1="platform" body2="piston{k}" anchor="{_text(self.head_positions[k])}" '
            'solimp="0.9999 0.9999 0.001"/>'
            for k in range(1, 6)
        ]
        self.model = mujoco.MjModel.from_xml_string(
            '<mujoco><option gravity="0 0 -9.81"><flag contact="disable"/></option><worldbody>'
            f"{''.join(legs)}</worldbody><equality>{''.join(rows)}</equality></mujoco>"
        )
        self.data = mujoco.MjData(self.model)

    def _leg_text(self, k: int, free_length: float) -> str:
        """Cylinder and piston at the initial state; the first leg carries the platform."""
        slide, tilt = (self.start.q[0, self.layout.hinges[f"{name}{k}"].q_slice]
                       for name in ("slide", "foot"))  # fmt: skip
        position = self.start.position(f"cylinder{k}")[0]
        orientation = self.start.orientation(f"cylinder{k}")[0]
        rest, outboard = free_length - slide[0], "" if k else self._platform_text(orientation)
        return (
            f'<body pos="{_text(position)}" quat="{_text(orientation)}">'
            f'<joint axis="{np.cos(tilt[1])} 0 {np.sin(tilt[1])}"/><joint axis="0 1 0"/>'
            f'{_inertial(0.2, 3.0, "0.04 0.04 1e-9")}<body name="piston{k}" pos="0 0 {slide[0]}">'
            f'<joint type="slide" axis="0 0 1" stiffness="4e4" springref="{rest}"/>'
            f"{_inertial(0.3, 1.5, '0.045 0.045 1e-9')}{outboard}</body></body>"
        )

    def _platform_text(self, orientation: np.ndarray) -> str:
        """The platform on the ball of the first leg, initially in ground axes."""
        inverse, position = orientation * [1, -1, -1, -1], -self.head_positions[0]
        return (
            f'<body pos="0 0 0.6" quat="{_text(inverse)}">'
            f'<body name="platform" pos="{_text(position)}">'
            f'<joint type="ball" pos="{_text(-position)}"/>'
            f"{_inertial(0.0, 20.0, '1.1 1.1 2')}</body></body>"
        )

    def forward(self, count: int) -> None:
        """Compute the accelerations `count` times without warm starts."""
        for _ in range(count):
            self.data.qacc_warmstart[:] = 0.0
            mujoco.mj_forward(self.model, self.data)

    def leg_accelerations(self) -> np.ndarray:
        """Accelerations of the six legs."""
        self.forward(1)
        joints = [self.model.body(f"piston{k}").jntadr[0] for k in range(6)]
        return np.array([self.data.qacc[self.model.jnt_dofadr[joint]] for joint in joints])
