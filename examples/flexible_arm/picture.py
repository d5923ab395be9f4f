"""The picture of this example.

python examples/flexible_arm/picture.py [FILE]
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
    """The arm as it moves; deflection in the middle of both links."""
    model = mstmm.compile(mstmm.load_scene(HERE / "scene.toml"))
    result = model.simulate(1.2, rtol=1e-6, output_times=np.linspace(0, 1.2, 481))
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.4))
    lines = {name: result.deflected_shape(name) for name in ("upper", "lower")}
    payload = result.position("payload")
    left.plot(payload[:, 0], payload[:, 1], color="#c1121f", lw=0.8)
    for row in range(0, 481, 40):
        shade = plt.colormaps["viridis"](row / 520)
        for line in lines.values():
            left.plot(line[row, :, 0], line[row, :, 1], color=shade, lw=1.8)
        left.plot(*payload[row, :2], "o", color=shade, ms=5)
    left.set(xlabel="x, m", ylabel="y, m", title="Every 0.1 s, and the payload's path")
    left.set_aspect("equal", adjustable="datalim")
    for name, length, colour in (("upper", 0.6, "#1d3557"), ("lower", 0.5, "#f4791f")):
        bent = 1e3 * result.deflection(name, length / 2)[:, 1]
        right.plot(result.t, bent, color=colour, label=f"{name} link")
    right.set(
        xlabel="time, s", ylabel="deflection of the middle from the chord, mm",
        title="Bending",
    )  # fmt: skip
    right.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
