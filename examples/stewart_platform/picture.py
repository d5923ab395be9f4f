"""The picture of this example.

python examples/stewart_platform/picture.py [FILE]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
PERIOD = 2 * np.pi / 4


def draw(path: Path) -> None:
    """The platform low and high; the efforts of its legs."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    result = model.simulate(PERIOD, rtol=1e-8, output_times=np.linspace(0.0, PERIOD, 201))
    figure = plt.figure(figsize=(10, 4.8))
    left = figure.add_subplot(121, projection="3d")
    left.set_position((-0.02, 0.0, 0.54, 1.0))
    for row, shade in ((150, 0.35), (50, 1.0)):
        feet = np.array([result.position(f"cylinder{k}")[row] for k in range(6)])
        heads = np.array([result.position(f"piston{k}.tip")[row] for k in range(6)])
        for foot, head in zip(feet, heads, strict=True):
            left.plot(*np.transpose([foot, head]), color="#1d3557", lw=1.4, alpha=shade)
            upper = foot + 0.4 * (head - foot) / np.linalg.norm(head - foot)
            left.plot(*np.transpose([foot, upper]), color="#1d3557", lw=4, alpha=shade)
        ring = np.vstack([heads, heads[:1]])
        left.plot(*ring.T, "-o", color="#c1121f", lw=2, ms=4, alpha=shade)
    ground = np.vstack([feet, feet[:1]])
    left.plot(*ground.T, "-", color="black", lw=1)
    left.set(xlabel="x, m", ylabel="y, m", zlabel="z, m", zlim=(0, 1.2))
    left.set_box_aspect((1.0, 1.0, 0.8))
    left.set(xticks=[-0.6, 0, 0.6], yticks=[-0.6, 0, 0.6], zticks=[0, 0.4, 0.8, 1.2])
    left.view_init(elev=18, azim=-65)
    right = figure.add_axes((0.6, 0.13, 0.38, 0.75))
    for k in range(6):
        right.plot(result.t, result.quantity(f"slide{k}.effort").values, color="#1d3557", lw=1.6)
    right.set(xlabel="time, s", ylabel="effort of a leg, N", title="All six legs push alike")
    right.set_ylim(0.0, None)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
