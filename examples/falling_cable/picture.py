"""The picture of this example.

python examples/falling_cable/picture.py [FILE]
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


def draw(path: Path) -> None:
    """The cable as it falls, whips and rises; the curvature along it over time."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    result = model.simulate(1.5, rtol=1e-6, output_times=np.linspace(0, 1.5, 301))
    lines = result.deflected_shape("cable", 81)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.6), width_ratios=(1.1, 1))
    for row in range(0, 301, 15):
        colour = plt.colormaps["viridis"](row / 330)
        left.plot(lines[row, :, 0], lines[row, :, 1], color=colour, lw=1.8)
    left.plot(0, 0, "o", color="black", ms=5)
    left.set(xlabel="x, m", ylabel="y, m", title="The cable, every 0.075 s")
    left.set_aspect("equal")
    x = np.linspace(0, 1, 101)
    bend = result.curvature("cable", x)[..., 1]
    limit = float(np.abs(bend).max())
    image = right.pcolormesh(
        result.t, x, bend.T, cmap="RdBu_r", vmin=-limit, vmax=limit, shading="gouraud"
    )
    figure.colorbar(image, label="curvature, rad/m")
    right.set(xlabel="time, s", ylabel="position along the cable, m", title="Curvature")
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
