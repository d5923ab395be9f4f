"""The picture of this example.

python examples/spray_boom/picture.py [FILE]
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
check: Any = import_module("check")  # beside this file
COLOURS = {"left_tip": "#1d3557", "left_half": "#e9a03b", "right_tip": "#2a9d8f"}


def tilted(values: Any, omega: Any) -> Any:
    """(k, outputs) m per rad: under a road that tilts as it does, angle and rate together."""
    return values[:, :, 1] + 1j * omega[:, None] * values[:, :, 2]


def draw(path: Path) -> None:
    """From the road and the leveller to the tips; the swing over the shape of the trapezoid."""
    model = check.model()
    linear = model.linearize(inputs=check.INPUTS)
    omega, coarse = (2 * np.pi * np.geomspace(0.03, 6, count) for count in (400, 45))
    swept = linear.frequency_response(omega, outputs=check.OUTPUTS).response
    nodes = check.Whole().response(coarse)
    figure, axes = plt.subplots(2, 2, figsize=(10, 6.4))
    for k, name in enumerate(check.OUTPUTS):
        style: dict[str, Any] = {"color": COLOURS[name], "lw": 1.2}
        dots: dict[str, Any] = {"color": COLOURS[name], "ls": "", "marker": "x", "ms": 4}
        road, points = tilted(swept, omega)[:, k], tilted(nodes, coarse)[:, k]
        label = name.replace("_", " ")
        axes[0, 0].loglog(omega / (2 * np.pi), np.abs(road), label=label, **style)
        axes[0, 0].loglog(coarse / (2 * np.pi), np.abs(points), **dots)
        axes[1, 0].semilogx(omega / (2 * np.pi), np.degrees(np.angle(road)), **style)
        axes[1, 0].semilogx(coarse / (2 * np.pi), np.degrees(np.angle(points)), **dots)
        if name != "right_tip":
            axes[0, 1].loglog(omega / (2 * np.pi), 1e6 * np.abs(swept[:, k, 0]), **style)
            axes[0, 1].loglog(coarse / (2 * np.pi), 1e6 * np.abs(nodes[:, k, 0]), **dots)
    axes[0, 0].plot([], [], "kx", ms=4, label="all nodes")
    axes[0, 0].set(ylabel="height, m per rad", title="the road tilts")
    axes[0, 0].legend(fontsize=8)
    axes[1, 0].set(xlabel="frequency, Hz", ylabel="phase, deg", yticks=(-180, -90, 0, 90, 180))
    axes[0, 1].set(xlabel="frequency, Hz", ylabel="height, mm per kN", title="the leveller pushes")
    _trapezoid(model, axes[1, 1])
    figure.tight_layout()
    figure.savefig(path, dpi=100)


def _trapezoid(model: Any, axis: Any) -> None:
    """How fast the boom swings, over the width of the trapezoid at the boom."""
    widths = np.linspace(0.28, 0.8, 27)
    locus = model.root_locus("constants.b", widths, 1)
    axis.plot(widths, np.abs(locus.eigenvalues[:, 0]) / (2 * np.pi), color="#1d3557")
    axis.plot([0.5], [0.1143], "o", color="#c1121f", ms=5, label="the scene")
    axis.set(xlabel="b, half the width at the boom, m", ylabel="swing, Hz", ylim=(0, None),
             title="the trapezoid (a = 0.25 m)")  # fmt: skip
    axis.legend(fontsize=8)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "picture.png")
