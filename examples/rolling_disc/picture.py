"""The picture of this example.

python examples/rolling_disc/picture.py [FILE]
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
RADIUS, THROWN = 0.3, 1.5
STEADY, WOBBLING = "#6c757d", "#1d3557"


def rims(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of the rim (times, 60, 3), and the lowest of each (times, 3)."""
    w, v = q[:, 3:4, None], q[:, None, 4:7]
    angle = np.linspace(0, 2 * np.pi, 60)
    own = RADIUS * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], 1)[None]
    turned = own + 2 * np.cross(v, np.cross(v, own) + w * own) + q[:, None, :3]
    return turned, turned[np.arange(len(q)), turned[:, :, 2].argmin(axis=1)]


def draw(path: Path) -> None:
    """The disc as it wobbles, both paths of its centre from above, and how it leans."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    times = np.linspace(0, 3.0, 1501)
    q, u = model.initial_state()
    steady = model.simulate(3.2, rtol=1e-9, output_times=np.linspace(0, 3.2, 801))
    u[[1, 3]] = [-RADIUS * THROWN, THROWN]
    thrown = model.simulate(3.0, rtol=1e-9, initial=(q, u), output_times=times)
    rim, lowest = rims(thrown.q)
    figure = plt.figure(figsize=(12, 4.2))
    view: Any = figure.add_axes((0.0, 0.02, 0.34, 0.94), projection="3d")
    for k in range(0, 1501, 125):
        shade = 0.2 + 0.8 * k / 1500
        view.plot(*rim[k].T, color=WOBBLING, lw=1.6, alpha=shade)
        spoke = np.stack([thrown.q[k, :3], rim[k, 0]])
        view.plot(*spoke.T, color="#c1121f", lw=1.2, alpha=shade)
    view.plot(lowest[:, 0], lowest[:, 1], 0, color="#f4a261", lw=1.5)
    view.set(xlabel="x, m", ylabel="y, m", zlim=(0, 0.6))
    view.set(xticks=[-1, 0], yticks=[-1, 0], zticks=[0, 0.5])
    view.set_aspect("equal")
    view.view_init(elev=28, azim=-60)
    above = figure.add_axes((0.435, 0.14, 0.25, 0.76))
    above.plot(*steady.q[:, :2].T, color=STEADY, label="steady circle")
    above.plot(*thrown.q[:, :2].T, color=WOBBLING, label="thrown over")
    above.plot(lowest[:, 0], lowest[:, 1], color="#f4a261", lw=1, label="where it touches")
    above.set(aspect="equal", xlabel="x, m", ylabel="y, m", title="Centre from above")
    above.legend(frameon=False, fontsize=8, loc="center")
    beside = figure.add_axes((0.74, 0.14, 0.25, 0.76))
    for result, color in ((steady, STEADY), (thrown, WOBBLING)):
        one = result.q
        lean = np.arcsin(2 * (one[:, 5] * one[:, 6] + one[:, 3] * one[:, 4]))
        beside.plot(result.t, np.degrees(lean), color=color)
    beside.set(xlabel="t, s", ylabel="lean, degrees", xlim=(0, 3), title="How it leans")
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
