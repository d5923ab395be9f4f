"""The picture of this example.

python examples/andrews/picture.py [FILE]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

HERE = Path(__file__).parent
#: Bodies by their corners.
BODIES = {
    "K1": ("K1", "K1.F"), "K2": ("K2", "K2.E"), "K3": ("K3", "K3.E", "K3.D"), "K4": ("K4", "K4.E"),
    "K5": ("K5", "K5.G"), "K6": ("K6", "K6.E"), "K7": ("K7", "K7.H"),
}  # fmt: skip
FEET = np.array([[0, 0], [-0.06934, -0.00227], [-0.03635, 0.03273], [0.014, 0.072]])
ROWS = (0, 45, 105, 180, 240, 300)


def draw_pose(axes: Axes, at: dict[str, NDArray[np.float64]], time: float) -> None:
    """All bodies at one time."""
    for number, corners in enumerate(BODIES.values()):
        places = np.array([at[corner][:2] for corner in corners])
        color = plt.colormaps["tab10"](number)
        if len(corners) > 2:
            axes.fill(places[:, 0], places[:, 1], color=color, alpha=0.3)
            places = np.vstack([places, places[:1]])
        axes.plot(places[:, 0], places[:, 1], "-o", color=color, lw=2, ms=3, zorder=9 - number)
    spring = np.array([FEET[3], at["K3.D"][:2]])
    axes.plot(spring[:, 0], spring[:, 1], ":", color="black", lw=1)
    axes.plot(FEET[:, 0], FEET[:, 1], "^", color="black", ms=6)
    axes.set_title(f"{1e3 * time:.1f} ms", fontsize=10)
    axes.set(xlim=(-0.08, 0.024), ylim=(-0.032, 0.08), xticks=[], yticks=[])
    axes.set_aspect("equal")


def draw(path: Path) -> None:
    """The mechanism at six times; its angles."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    result = model.simulate(0.03, rtol=1e-8, output_times=np.linspace(0.0, 0.03, 301))
    figure = plt.figure(figsize=(10, 5.0))
    grid = figure.add_gridspec(
        2,
        5,
        width_ratios=(1, 1, 1, 0.2, 2.4),
        left=0.02,
        right=0.98,
        bottom=0.1,
        top=0.88,
        wspace=0.12,
        hspace=0.16,
    )
    places = {name: result.position(name) for corners in BODIES.values() for name in corners}
    for number, row in enumerate(ROWS):
        axes = figure.add_subplot(grid[number // 3, number % 3])
        draw_pose(axes, {name: place[row] for name, place in places.items()}, result.t[row])
        if number == 0:
            axes.plot([-0.072, -0.052], [-0.024] * 2, color="black", lw=3, solid_capstyle="butt")
            axes.text(-0.062, -0.021, "20 mm", ha="center", fontsize=8)
            axes.text(-0.005, 0.056, "spring", ha="right", fontsize=8)
            axes.text(0.007, -0.012, "crank", ha="center", fontsize=8)
    axes = figure.add_subplot(grid[:, 4])
    for name in ("beta", "Theta", "gamma", "delta", "Phi", "eps"):
        angle = result.q[:, model.coordinate_layout.hinges[name].q_slice][:, 0]
        wrapped = np.mod(angle + np.pi, 2 * np.pi) - np.pi
        wrapped[np.abs(np.diff(wrapped, append=wrapped[-1])) > np.pi] = np.nan
        axes.plot(1e3 * result.t, wrapped, label=name, lw=1.4)
    axes.set(xlabel="time, ms", ylabel="angle, rad, whole turns left out", ylim=(-3.5, 3.5))
    axes.legend(frameon=False, ncols=3, loc="upper center", bbox_to_anchor=(0.5, 1.13), fontsize=9)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
