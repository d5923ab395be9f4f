"""The picture of this example.

python examples/spin_up/picture.py [FILE]
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


def run(stiffening: bool) -> mstmm.Result:
    """20 s."""
    data = tomllib.loads((HERE / "scene.toml").read_text(encoding="utf-8"))
    data["beam"][0]["stiffening"] = stiffening
    model = mstmm.compile(mstmm.Scene(**data))
    return model.simulate(20.0, rtol=1e-6, output_times=np.linspace(0, 20, 401))


def draw(path: Path) -> None:
    """Deflection over time; the beam every second as it turns."""
    stiff, linear = run(True), run(False)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.4), width_ratios=(1.25, 1))
    left.plot(
        stiff.t, stiff.deflection("blade", "tip")[:, 1], color="#c1121f", label="with stiffening"
    )
    early = linear.t < 9.0
    left.plot(
        linear.t[early], linear.deflection("blade", "tip")[early, 1], "--", color="#7f7f7f",
        label="without",
    )  # fmt: skip
    left.axhline(-0.57375, color="black", lw=0.7, ls=":", label="largest, exact beam")
    left.set(
        xlabel="time, s", ylabel="deflection of the tip, m", ylim=(-1.2, 0.3),
        title="Against the turning root direction",
    )  # fmt: skip
    left.legend(frameon=False)
    lines = stiff.deflected_shape("blade")
    for row in range(0, 181, 20):  # every second
        colour = plt.colormaps["viridis"](row / 200)
        right.plot(lines[row, :, 0], lines[row, :, 1], color=colour, lw=1.6)
        right.annotate(f"{stiff.t[row]:.0f} s", lines[row, -1, :2] * 1.06, fontsize=7, ha="center")
    right.set(xlabel="x, m", ylabel="y, m", title="The beam, every second")
    right.set_aspect("equal")
    right.margins(0.12)
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
