"""The picture of this example.

python examples/elastic_link/picture.py [FILE]
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
check: Any = import_module("check")  # beside this file
Array = NDArray[np.float64]
MAGNIFIED = 15.0


def line(tip: Array, slope: float) -> Array:
    """(m, 2) the bent axis in the turning axes: a cubic with the tip's place and slope."""
    s = np.linspace(0, 1, 40)
    bump, turn = s**2 * (3 - 2 * s), s**2 * (s - 1)
    return np.stack([0.5 * s, MAGNIFIED * (bump * tip[2] + 0.5 * turn * slope)], axis=1)


def slopes(result: mstmm.Result) -> Array:
    """(n,) slope of the tip against the turning root."""
    w, _, y, _ = result.orientation("link.tip").T
    return np.array([-2 * np.arctan2(b, a) - check.swing(t)[0] for t, a, b in
                     zip(result.t, w, y, strict=True)])  # fmt: skip


def draw(path: Path) -> None:
    """The swing with magnified deflections; the tip against all nodes, and one way."""
    scene, times = mstmm.load_scene(HERE / "scene.toml"), np.linspace(0, check.END, 281)
    coupled, one_way = (
        mstmm.compile(scene, flexibility=level).simulate(check.END, output_times=times)
        for level in ("coupled", "one-way")
    )
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.4), width_ratios=(1, 1.5))
    bent, turned = check.relative_tip(coupled), slopes(coupled)
    for k in range(0, 161, 20):
        angle = check.swing(times[k])[0]
        x, z = line(bent[k], turned[k]).T
        shade = plt.colormaps["viridis"](times[k] / 0.45)
        places = np.cos(angle) * x - np.sin(angle) * z, np.sin(angle) * x + np.cos(angle) * z
        left.plot(*places, color=shade, label=f"{times[k]:.2f} s")
        left.plot(places[0][-1], places[1][-1], "o", color=shade)
    left.set(xlabel="x, m", ylabel="z, m", aspect="equal", xlim=(-0.03, 0.72),
             title=f"deflections times {MAGNIFIED:.0f}")  # fmt: skip
    left.legend(fontsize=7, loc="upper right")
    right.plot(times, 1e3 * bent[:, 2], color="#1d3557", label="coupled, 10 shapes")
    right.plot(
        times, 1e3 * check.relative_tip(one_way)[:, 2], color="#e9a03b", lw=1, label="one-way"
    )
    rows = slice(None, None, 8)
    right.plot(times[rows], 1e3 * check.Nodes().tip(times[rows])[:, 2], "x", color="#c1121f", ms=4,
               label="all nodes")  # fmt: skip
    right.set(
        xlabel="time, s", ylabel="tip against the turning root, mm", title="swing and ringing"
    )
    right.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
