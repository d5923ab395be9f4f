"""The picture of this example.

python examples/planetary_gear/picture.py [FILE]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import Circle

HERE = Path(__file__).parent
COLORS = {"sun": "#c1121f", "ring": "#1d3557", "carrier": "#2a9d8f"}


def draw(path: Path) -> None:
    """The wheels with a mark each after 0.12 s; speeds of two shafts, the angle of the third."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    times = np.linspace(0.0, 0.5, 501)
    result = model.simulate(0.5, "dop853", rtol=1e-9, output_times=times)
    figure, axes = plt.subplot_mosaic("ab;ac", figsize=(10, 4.6), width_ratios=(1, 1.3))
    left, right, below = (axes[name] for name in "abc")
    sun, ring, carrier, *planets = result.q[120]
    wheels = [(0j, 0.03, sun, COLORS["sun"]), (0j, 0.07, ring, COLORS["ring"])]
    for k, own in enumerate(planets):
        center = 0.05 * np.exp(1j * (carrier + 2 * np.pi * k / 3))
        wheels.append((center, 0.02, carrier + own, "#6c757d"))
        left.plot([0, center.real], [0, center.imag], color=COLORS["carrier"], lw=3, zorder=0)
    for center, radius, angle, color in wheels:
        left.add_patch(Circle((center.real, center.imag), radius, fill=False, ec=color, lw=2))
        mark = center + radius * np.exp(1j * angle)
        left.plot(mark.real, mark.imag, "o", color=color, ms=7)
    left.set(xlabel="x, m", ylabel="y, m", title="After 0.12 s", xlim=(-0.08, 0.08))
    left.set(ylim=(-0.08, 0.08), aspect="equal")
    for k, name in ((0, "sun"), (2, "carrier")):
        right.plot(times, result.u[:, k], color=COLORS[name], label=name)
    right.set(ylabel="speed, rad/s", title="The sun is turned, the carrier follows")
    right.legend(frameon=False)
    below.plot(times, np.degrees(result.q[:, 1]), color=COLORS["ring"])
    below.set(xlabel="t, s", ylabel="angle, degrees", title="The ring swings on its spring")
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
