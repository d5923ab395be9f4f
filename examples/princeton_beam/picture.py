"""The picture of this example.

python examples/princeton_beam/picture.py [FILE]
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import matplotlib as mpl
import numpy as np

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent


def axis_of_beam(angle: float) -> np.ndarray:
    """Points of the deflected axis in equilibrium."""
    data = tomllib.loads((HERE / "scene.toml").read_text(encoding="utf-8"))
    data["constants"]["angle"] = angle
    model = mstmm.compile(mstmm.Scene(**data))
    start = (np.asarray(model.equilibrium()), np.zeros(model.nu))
    return model.simulate(1e-9, initial=start).deflected_shape("beam")[0]


def draw(path: Path) -> None:
    """The beam from the side of the thin and of the wide side of its section."""
    figure, axes = plt.subplots(2, 1, figsize=(8, 5), sharex=True, height_ratios=(3, 1))
    for k, degrees in enumerate(range(0, 91, 15)):
        points = axis_of_beam(float(np.radians(degrees)))
        colour = plt.colormaps["viridis"](k / 7)
        for axis, row in zip(axes, (1, 2), strict=True):
            axis.plot(points[:, 0], 1e3 * points[:, row], color=colour, label=f"{degrees}°")
    axes[0].legend(title="direction of the weight", frameon=False, ncols=2)
    axes[0].set(ylabel="y, mm", title="Beam under 8.9 N at its tip, bent about the thin side")
    axes[1].set(xlabel="x, m", ylabel="z, mm", title="and about the wide side")
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
