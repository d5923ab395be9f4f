"""Stewart's platform of the examples in MuJoCo: five balls as equality constraints."""

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
    """The same bodies in the start of a model; all coordinates are zero there."""

    def __init__(self, model: mstmm.Model) -> None:
        self.start, self.layout = model.simulate(0.0), model.coordinate_layout
        platform = next(body for body in model.scene.body if body.name == "platform")
        self.heads = [np.array(platform.ends[f"head{k}"].position) for k in range(6)]
        rests = [h.law.rest for h in model.scene.hinge if h.type == "prismatic" and h.law]
        legs = [self._leg(k, float(np.ravel(rests[k])[0])) for k in range(6)]
        rows = [
            f'<connect body1="platform" body2="piston{k}" anchor="{_text(self.heads[k])}" '
            'solimp="0.9999 0.9999 0.001"/>'
            for k in range(1, 6)
        ]
        self.made = mujoco.MjModel.from_xml_string(
            '<mujoco><option gravity="0 0 -9.81"><flag contact="disable"/></option><worldbody>'
            f"{''.join(legs)}</worldbody><equality>{''.join(rows)}</equality></mujoco>"
        )
        self.data = mujoco.MjData(self.made)

    def _leg(self, k: int, rest: float) -> str:
        """Cylinder and piston as they lie at the start; the first carries the platform."""
        slide, tilt = (self.start.q[0, self.layout.hinges[f"{word}{k}"].q_slice]
                       for word in ("slide", "foot"))  # fmt: skip
        place = self.start.position(f"cylinder{k}")[0]
        turned = self.start.orientation(f"cylinder{k}")[0]
        return (
            f'<body pos="{_text(place)}" quat="{_text(turned)}">'
            f'<joint axis="{np.cos(tilt[1])} 0 {np.sin(tilt[1])}"/><joint axis="0 1 0"/>'
            f'{_inertial(0.2, 3.0, "0.04 0.04 1e-9")}<body name="piston{k}" pos="0 0 {slide[0]}">'
            f'<joint type="slide" axis="0 0 1" stiffness="4e4" springref="{rest - slide[0]}"/>'
            f"{_inertial(0.3, 1.5, '0.045 0.045 1e-9')}{'' if k else self._carried(turned)}"
            "</body></body>"
        )

    def _carried(self, turned: np.ndarray) -> str:
        """The platform on the ball of the first leg, in the axes of the ground at the start."""
        back = _text(turned * [1, -1, -1, -1])
        place = _text(-self.heads[0])
        return (
            f'<body pos="0 0 0.6" quat="{back}"><body name="platform" pos="{place}">'
            f'<joint type="ball" pos="{_text(self.heads[0])}"/>{_inertial(0.0, 20.0, "1.1 1.1 2")}'
            "</body></body>"
        )

    def forward(self, count: int) -> None:
        """Accelerations so many times, nothing taken over from the last."""
        for _ in range(count):
            self.data.qacc_warmstart[:] = 0.0
            mujoco.mj_forward(self.made, self.data)

    def slides(self) -> np.ndarray:
        """Accelerations of the six legs."""
        self.forward(1)
        joints = [self.made.body(f"piston{k}").jntadr[0] for k in range(6)]
        return np.array([self.data.qacc[self.made.jnt_dofadr[joint]] for joint in joints])
