"""The picture of this example.

python examples/satellite_panels/picture.py [FILE]
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
    """Tip deflections and angular velocity over time; the satellite as it turns."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"), engine="looped")
    result = model.simulate(12.0, rtol=1e-6, output_times=np.linspace(0, 12, 601))
    figure = plt.figure(figsize=(10, 4.6))
    upper, lower = figure.add_subplot(221), figure.add_subplot(223)
    tip = 1e3 * result.deflection("east", "tip")
    for column, label, colour in ((1, "in the plane", "#1d3557"), (2, "out of it", "#c1121f")):
        upper.plot(result.t, tip[:, column], color=colour, label=label)
    upper.set(ylabel="tip of a panel, mm", title="Slew within 8 s, and what is left")
    upper.legend(frameon=False, ncol=2)
    spin, rigid = result.angular_velocity("hub"), result.angular_velocity("east.tip")
    lower.plot(result.t, rigid[:, 2], color="#f4791f", lw=0.9, label="tip section")
    lower.plot(result.t, spin[:, 2], color="#2a9d8f", label="hub")
    lower.set(xlabel="time, s", ylabel="rate about z, rad/s")
    lower.legend(frameon=False, ncol=2)
    space = figure.add_subplot(122, projection="3d")
    for row, shade in ((0, "#472d7b"), (250, "#21918c"), (600, "#a0da39")):
        for panel in ("east", "west"):
            line = result.deflected_shape(panel)[row]
            space.plot(*line.T, color=shade, lw=2.5)
        space.plot([], [], color=shade, lw=2.5, label=f"{result.t[row]:.0f} s")
        space.scatter(*result.position("hub")[row], color=shade, s=60, marker="s")
    space.set(xlabel="x, m", ylabel="y, m", zlabel="z, m", title="Hub and panels")
    space.set_box_aspect((1, 1, 0.6))
    space.legend(frameon=False, loc="upper left")
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
