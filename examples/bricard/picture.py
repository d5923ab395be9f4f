"""The picture of this example.

python examples/bricard/picture.py [FILE]
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
POSES = (0.0, 0.5, 1.0)


def draw(path: Path) -> None:
    """The ring at three times; the path of its corner."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    result = model.simulate(10.0, rtol=1e-9, output_times=np.linspace(0.0, 10.0, 1001))
    corners = [np.zeros_like(result.position("rod1"))]
    corners += [result.position(f"rod{k}.tip") for k in range(1, 6)]
    ring = np.stack([*corners, corners[0]], axis=1)
    figure = plt.figure(figsize=(12, 4.0))
    for number, time in enumerate(POSES):
        axes: Any = figure.add_axes((0.25 * number, 0.0, 0.25, 1.0), projection="3d")
        x, z, y = ring[np.searchsorted(result.t, time - 1e-9)].T[[0, 2, 1]]
        axes.plot(x[:6], z[:6], y[:6], "-o", color="#1d3557", lw=3, ms=4)
        axes.plot(x[5:], z[5:], y[5:], "--", color="black", lw=1)
        axes.plot(x[3:4], z[3:4], y[3:4], "o", color="#c1121f", ms=7)
        axes.set(xlim=(-1.1, 1.1), ylim=(-1.8, 0.2), zlim=(-0.5, 1.3))
        axes.set(xticklabels=[], yticklabels=[], zticklabels=[])
        axes.set_box_aspect((2.2, 2.0, 1.8), zoom=0.95)
        axes.text2D(0.5, 0.9, f"{time:.1f} s", transform=axes.transAxes, ha="center")
        axes.set_xlabel("x", labelpad=-12)
        axes.set_ylabel("z", labelpad=-12)
        axes.set_zlabel("y", labelpad=-12)
        axes.view_init(elev=22, azim=-62)
    side = figure.add_axes((0.82, 0.13, 0.17, 0.83))
    for k, name in enumerate("xyz"):
        color = ("#c1121f", "#1d3557", "#f4a261")[k]
        side.plot(result.t, ring[:, 3, k], color=color, lw=1.5, label=name)
    side.set(xlabel="time, s", ylabel="place of the red corner, m", ylim=(-2.0, 1.7))
    side.legend(frameon=False, ncols=3, loc="upper center", fontsize=9, columnspacing=1)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
