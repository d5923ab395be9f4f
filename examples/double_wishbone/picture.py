"""The picture of this example.

python examples/double_wishbone/picture.py [FILE]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from check import attitudes, moved

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
BLUE, RED = "#1d3557", "#c1121f"
#: Lines from point to point, as seen from the front.
LINES = (
    ("car.lower", "lower.ball"), ("car.upper", "upper.ball"), ("upright", "upright.top"),
    ("tie", "tie.ball"), ("upright", "upright.hub"),
)  # fmt: skip


def draw(path: Path) -> None:
    """The corner from the front before and on the bump; heave, camber and steer over time."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    times = np.linspace(0.0, 3.0, 601)
    result = model.simulate(3.0, rtol=1e-8, output_times=times)
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 4.4), width_ratios=(1, 1, 1))
    for row, color in ((0, "0.65"), (100, BLUE)):
        at = {
            name: result.position(name)[row, 1:]
            for name in {*sum(LINES, ()), "car.dome", "lower.seat", "road"}
        }
        for one, other in LINES:
            left.plot(*np.transpose([at[one], at[other]]), "-o", color=color, lw=2.4, ms=4)
        left.plot(*np.transpose([at["car.dome"], at["lower.seat"]]), ":", color=color, lw=2)
        hub, axle = at["upright.hub"], result.orientation("upright")[row]
        tilt = 2 * axle[1]
        reach = 0.3 * np.array([-np.sin(tilt), np.cos(tilt)])
        left.plot(*np.transpose([hub - reach, hub + reach]), color=color, lw=14, alpha=0.35,
                  solid_capstyle="butt")  # fmt: skip
        left.plot(at["road"][0] + np.array([-0.1, 0.1]), [at["road"][1]] * 2, color=color, lw=2)
    left.set(xlabel="y, m", ylabel="z, m", title="On the bump (grey: at rest)")
    left.set(xlim=(0.3, 0.95), ylim=(-0.03, 0.8))
    left.set_aspect("equal")
    q, _ = moved(result)
    for column, color, label in ((3, "0.6", "road"), (0, RED, "car")):
        middle.plot(times, 1e3 * q[:, column], color=color, lw=1.6, label=label)
    hub = result.position("upright.hub")[:, 2]
    middle.plot(times, 1e3 * (hub - hub[0]), color=BLUE, lw=1.6, label="hub")
    middle.set(xlabel="time, s", ylabel="height above the start, mm", title="A bump of 40 mm")
    middle.legend(frameon=False)
    camber, steer = (attitudes(q) - attitudes(q[:1])).T
    right.plot(times, camber, color=BLUE, lw=1.6, label="camber")
    right.plot(times, steer, color=RED, lw=1.6, label="steer")
    right.set(xlabel="time, s", ylabel="degrees from the start", title="What the wheel does")
    right.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
