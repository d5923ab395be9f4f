"""The picture of this example.

python examples/n_four_bar/picture.py [FILE]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from check import TIMES, pendulum, windows

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
COUNT = 5
POSES = (0.0, 0.4, 0.8, 1.0)


def draw(path: Path) -> None:
    """Five windows on their way down; the error of their angle by tolerance."""
    model = mstmm.compile(windows(COUNT))
    result = model.simulate(1.0, rtol=1e-8, output_times=POSES)
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.4), width_ratios=(1.45, 1))
    for row, time in enumerate(POSES):
        shade = 0.25 + 0.25 * row
        for k in range(COUNT + 1):
            tip = result.position(f"crank{k}.tip")[row]
            left.plot([k, tip[0]], [0, tip[1]], "-o", color="#1d3557", ms=3, lw=1.6, alpha=shade)
        first, last = (result.position(f"crank{k}.tip")[row] for k in (0, COUNT))
        left.plot([first[0], last[0]], [first[1], last[1]], color="#c1121f", lw=2, alpha=shade)
        left.text(last[0] + 0.12, last[1], f"{time:.1f} s", va="center")
    left.plot(range(COUNT + 1), [0] * (COUNT + 1), "^", color="black", ms=6)
    left.set(xlabel="x, m", ylabel="y, m", title="Five windows on their way down")
    left.set(xlim=(-0.3, COUNT + 1.9), ylim=(-1.25, 1.2))
    left.set_aspect("equal")

    model, wanted = mstmm.compile(windows(40)), pendulum(40)
    crank = model.coordinate_layout.hinges["foot0"].q_slice.start
    flat = TIMES[1:][np.diff(np.floor(wanted / np.pi)) != 0]
    for time in flat:
        right.axvline(time, color="0.85", lw=1)
    for rtol, color in ((1e-6, "#f4a261"), (1e-8, "#c1121f"), (1e-10, "#1d3557")):
        result = model.simulate(10.0, "dop853", rtol=rtol, atol=1e-3 * rtol, output_times=TIMES)
        error = np.abs(result.q[:, crank] - wanted)
        right.semilogy(TIMES[1:], error[1:], color=color, lw=1.6, label=f"rtol {rtol:.0e}")
    right.set(xlabel="time, s", ylabel="error of a crank's angle, rad", ylim=(1e-13, 1e-1))
    right.set_title("Forty windows; in grey where all is in line")
    right.legend(frameon=False, ncols=3, loc="upper center", fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
