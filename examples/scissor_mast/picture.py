"""The picture of this example.

python examples/scissor_mast/picture.py [FILE]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from check import TIME, mast

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import LineCollection

HERE = Path(__file__).parent
UNITS = 12


def draw(path: Path) -> None:
    """A mast of twelve units at five times; what draws its foot in."""
    model = mstmm.compile(mast(UNITS))
    result = model.simulate(TIME, rtol=1e-8, output_times=np.linspace(0.0, TIME, 201))
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 5.6), width_ratios=(1.25, 1))
    rods = [f"{side}{unit}" for unit in range(UNITS) for side in "ab"]
    lines = np.stack(
        [np.stack([result.position(rod), result.position(f"{rod}.tip")], 1) for rod in rods], 1
    )[..., :2]
    for number, row in enumerate((0, 70, 100, 130, 200)):
        shown = lines[row] + [0.75 * number, 0.0]
        colors = ["#1d3557", "#457b9d"] * UNITS
        left.add_collection(LineCollection(list(shown), colors=colors, linewidths=1.6))
        width, height = lines[row][..., 0].max(), lines[row][..., 1].max()
        left.text(0.75 * number + width / 2, height + 0.1, f"{result.t[row]:.1f} s", ha="center")
    left.plot([-0.1, 3.7], [0, 0], color="black", lw=1)
    left.set(xticks=[], ylabel="height, m", title="Twelve units on their way up")
    left.set(xlim=(-0.1, 3.7), ylim=(-0.1, 5.8))
    left.set_aspect("equal")
    left.spines[["top", "right", "bottom"]].set_visible(False)
    effort = -result.quantity("slide.effort").values
    right.plot(result.t, effort, color="#c1121f", lw=1.8)
    right.set(
        xlabel="time, s", ylabel="force that draws the foot in, N",
        title="Drawn hardest while it is low",
    )  # fmt: skip
    right.axhline(0.0, color="black", lw=0.6)
    right.set_ylim(0.0, 1.08 * effort.max())
    figure.tight_layout()
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
