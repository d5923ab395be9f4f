"""The picture of this example.

python examples/javelin/picture.py [FILE]
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

import mstmm

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
FRAMES: dict[str, dict[str, Any]] = {
    "tangent at the grip": {"modes": {"y": 2}},
    "chord": {"frame": "chord", "basis": "simply-supported", "modes": {"y": 6}},
    "mean": {"frame": "mean", "basis": "free-free", "modes": {"y": 6}},
}
X = np.linspace(0.0, 2.0, 81)
COLOURS = ("#1d3557", "#2a9d8f", "#c1121f")


def run(beam: dict[str, Any], times: NDArray[np.float64]) -> mstmm.Result:
    """The throw with other keys of the beam."""
    data = tomllib.loads((HERE / "scene.toml").read_text(encoding="utf-8"))
    data["beam"][0] |= beam
    model = mstmm.compile(mstmm.Scene(**data))
    return model.simulate(times[-1], rtol=1e-7, output_times=times)


def midpoint_speed(result: mstmm.Result) -> NDArray[np.float64]:
    """Vertical speed of the point of the floating frame in the middle of the beam at rest."""
    w, _, _, z = result.orientation("javelin").T
    turn = 2 * np.arctan2(z, w)
    spin = result.angular_velocity("javelin")[:, 2]
    return np.asarray(result.velocity("javelin")[:, 1] + spin * np.cos(turn))


def draw(path: Path) -> None:
    """Deflections; the speed of the frames against that of a rigid body."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.4))
    result = run(FRAMES["tangent at the grip"], np.linspace(0.4, 1.3, 10))
    bent = 1e3 * (result.deflection("javelin", X) - result.deflection("javelin", 0.0)[:, None])
    bent = bent[:, :, 1] - X / 2 * bent[:, -1:, 1]
    for t, line in zip(result.t, bent, strict=True):
        led = t < 1 - 1e-9
        shade = plt.colormaps["Reds" if led else "Blues"](t if led else 0.4 + 2 * (t - 1))
        left.plot(X, line, color=shade, label=f"{t:.1f} s")
    left.set(
        xlabel="x along the javelin, m", ylabel="deflection from the chord, mm",
        title="Led by the hinge until 1 s, then flying",
    )  # fmt: skip
    left.set_xlim(-0.1, 2.75)
    left.legend(frameon=False, fontsize=8, loc="center right")
    times = np.linspace(0.5, 1.5, 1001)
    for colour, (name, beam) in zip(COLOURS, FRAMES.items(), strict=True):
        result = run(beam, times)
        flying = times >= 1
        start = result.equivalent_velocity("javelin")[flying][0, 1]
        rest = midpoint_speed(result)[flying] - start + 9.81 * (times[flying] - 1)
        right.plot(times[flying], rest, color=colour, label=name, lw=1.6 if name == "mean" else 0.9)
    right.set(
        xlabel="time, s", ylabel="vertical speed of the frame less V0 - g t, m/s",
        title="Floating frames in flight",
    )  # fmt: skip
    right.legend(frameon=False, loc="upper right", ncol=3)
    right.margins(y=0.2)
    figure.tight_layout()
    figure.savefig(path, dpi=140)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
