"""The picture of this example.

python examples/slider_crank_flexible/picture.py [FILE]
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
CRANK, LENGTH, SHOWN = 0.15, 0.30, 100.0
STEEL, ROD, RED = "#6c757d", "#1d3557", "#c1121f"


def draw(path: Path) -> None:
    """The mechanism at four times of a turn, its rod bent a hundred times as much; the middle of
    the rod, and how much longer it is."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    times = np.linspace(0.0, 0.1, 2001)
    result = model.simulate(0.1, rtol=1e-8, atol=1e-10, output_times=times)
    modes = result.q[:, model.coordinate_layout.modal["rod"].q_slice]
    figure, axes = plt.subplot_mosaic("aa;bc", figsize=(10, 5.6), height_ratios=(1.15, 1))
    above, left, right = (axes[name] for name in "abc")
    turn, x = 2 * np.pi / 150.0, np.linspace(0, 1, 60)
    pose = np.searchsorted(times, turn * np.array([0.08, 0.33, 0.58, 0.83]) + turn)
    for number, k in enumerate(pose):
        pin, wrist = result.position("crank.pin")[k], result.position("slider")[k]
        along = (wrist - pin)[:2] / LENGTH
        across = np.array([-along[1], along[0]])
        bent = SHOWN * (modes[k, 0] * np.sin(np.pi * x) + modes[k, 1] * np.sin(2 * np.pi * x))
        line = pin[:2] + np.outer(LENGTH * x, along) + np.outer(bent, across)
        shade = 0.3 + 0.7 * number / 3
        above.plot([0, pin[0]], [0, pin[1]], color=STEEL, lw=4, alpha=shade)
        above.plot(*line.T, color=ROD, lw=2, alpha=shade)
        above.plot(*np.stack([pin, wrist])[:, :2].T, "--", color=ROD, lw=0.7, alpha=shade)
        above.plot(wrist[0], wrist[1], "s", color=RED, ms=11, alpha=shade)
    above.plot(0, 0, "o", color="black", ms=6)
    above.axhline(0, color="black", lw=0.5, zorder=0)
    above.set(aspect="equal", xlabel="x, m", ylabel="y, m", xlim=(-0.2, 0.5))
    above.set_title(f"One turn in four poses, bending drawn {SHOWN:.0f} times as large")
    left.plot(1e3 * times, 1e3 * modes[:, 0], color=ROD, lw=1.2)
    left.plot(100, 0.1893192460613870, "o", color=RED, label="published")
    left.set(xlabel="t, ms", ylabel="deflection, mm", title="Middle of the rod")
    left.legend(frameon=False, loc="lower left")
    right.plot(1e3 * times, 1e6 * modes[:, 3], color=ROD, lw=0.8)
    right.set(xlabel="t, ms", ylabel="stretch, µm", title="How much longer the rod is")
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
