"""The picture of this example.

python examples/four_bar/picture.py [FILE]
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
TURN = 2 * np.pi / 6


def draw(path: Path) -> None:
    """The linkage at twelve angles over the curve of its tip; the effort over a turn."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    result = model.simulate(TURN, rtol=1e-8, output_times=np.linspace(0.0, TURN, 361))
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 5), width_ratios=(1, 1.1))
    tip = result.position("coupler.tip")
    places = [
        np.zeros_like(tip), result.position("crank.tip"), result.position("coupler.joint"),
        np.tile([0.2, 0.0, 0.0], (len(tip), 1)),
    ]  # fmt: skip
    for row in range(0, 360, 30):
        shade = 1.0 if row == 150 else 0.15
        lines = np.array([place[row, :2] for place in places])
        left.plot(lines[:, 0], lines[:, 1], "-o", color="black", lw=1.6, ms=3, alpha=shade)
        reach = np.array([places[2][row, :2], tip[row, :2]])
        left.plot(reach[:, 0], reach[:, 1], "-", color="black", lw=1.6, alpha=shade)
    left.plot(tip[:, 0], tip[:, 1], color="#c1121f", lw=2, label="tip of the coupler")
    left.plot(tip[::30, 0], tip[::30, 1], "o", color="#c1121f", ms=4)
    left.set(xlabel="x, m", ylabel="y, m", title="Every thirty degrees of the crank")
    left.set_aspect("equal")
    left.margins(0.08)
    left.legend(frameon=False, loc="lower right")
    right.plot(
        np.linspace(0, 360, 361), result.quantity("crank_pin.effort").values, color="#1d3557"
    )
    right.axhline(0.0, color="black", lw=0.6)
    right.set(
        xlabel="angle of the crank, degrees", ylabel="effort of the drive, N m",
        title="What keeps the crank at 6 rad/s", xticks=range(0, 361, 60),
    )  # fmt: skip
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
