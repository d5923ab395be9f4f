"""The picture of this example.

python examples/flexible_arm_control/picture.py [FILE]
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt

check: Any = import_module("check")  # the design, beside this file

#: What a motor does that knows the angle alone: as stiff, and damped.
SERVO = {
    "name": "servo", "sample_time": 0.01, "inputs": ["turn", "shoulder.angle_rate"],
    "outputs": ["motor"], "D": [[-20.0, -8.0]], "initial": [],
}  # fmt: skip


def draw(path: Path) -> None:
    """The tip, the motor and the shape of the arm on its way."""
    times = np.linspace(0, 3, 601)
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12, 3.8))
    found = {}
    for name, controller in (
        ("LQR with observer", check.regulator(check.linear_model())),
        ("servo", SERVO),
    ):
        model = mstmm.compile(check.closed(controller))
        found[name] = model.simulate(3.0, rtol=1e-8, output_times=times)
    for (name, result), colour in zip(found.items(), ("#1d3557", "#f4791f"), strict=True):
        left.plot(times, result.position("arm.tip")[:, 1], color=colour, label=name)
        middle.plot(times, result.quantity("motor").values, color=colour, lw=0.9)
    line = found["LQR with observer"].deflected_shape("arm")
    for row in range(0, 301, 25):
        right.plot(line[row, :, 0], line[row, :, 1], color=plt.colormaps["viridis"](row / 330))
    left.set(xlabel="time, s", ylabel="tip from its goal, m", title="Where the tip is")
    middle.set(xlabel="time, s", ylabel="torque of the motor, N m", title="What the motor does")
    right.set(xlabel="x, m", ylabel="y, m", title="The arm every 0.125 s, LQR")
    right.set_aspect("equal", adjustable="datalim")
    left.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("picture.png"))
