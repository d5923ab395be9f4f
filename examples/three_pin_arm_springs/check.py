"""Pins replaced by stiff spring-damper hinges: the arm tends to the arm on pins.

Statement: with stiffness k and damping growing as sqrt(k) (the same damping ratio), the largest
difference of the three angles from the arm on pins falls as 1/k, the law of a quasi-static
deflection; the gap that opens at the loaded hinges is the hinge force of the arm on pins over k.
"""

from __future__ import annotations

import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import mstmm

HERE = Path(__file__).parent
TIMES = np.linspace(0.3, 1.2, 31)
SCALES = (1.0, 4.0, 16.0, 64.0)
Array = NDArray[np.float64]


def run(scene: mstmm.Scene) -> mstmm.Result:
    """Integrate to the last sample."""
    result = mstmm.compile(scene).simulate(
        t_end=TIMES[-1], method="dop853", rtol=1e-10, atol=1e-12, output_times=TIMES
    )
    assert result.success, result.message
    return result


def stiffer(scale: float) -> mstmm.Scene:
    """The scene with its stiffness times `scale` and its damping times the square root."""
    with (HERE / "scene.toml").open("rb") as file:
        data = tomllib.load(file)
    for hinge in data["hinge"]:
        law = hinge["law"]
        law["stiffness"] = [scale * k for k in law["stiffness"]]
        law["damping"] = [np.sqrt(scale) * c for c in law["damping"]]
    return mstmm.Scene(**data)


def angles(result: mstmm.Result) -> Array:
    """Unwrapped angle about the hinge axis of the three hinges (time, 3)."""
    columns = [2 * np.arctan2(result.q[:, 7 * i + 6], result.q[:, 7 * i + 3]) for i in range(3)]
    return np.unwrap(np.stack(columns, axis=1), axis=0)


def main() -> None:
    """Compare four stiffnesses with the arm on pins."""
    pins = run(mstmm.load_scene(HERE.parent / "three_pin_arm" / "scene.toml"))
    loads = np.stack([pins.force(name) for name in ("pin0", "pin2", "pin4")], axis=1)
    errors = []
    for scale in SCALES:
        result = run(stiffer(scale))
        errors.append(float(abs(angles(result) - pins.q).max()))
        gaps = np.stack([result.q[:, 7 * i : 7 * i + 3] for i in range(3)], axis=1)
    stiffness = 1e5 * SCALES[-1]
    ratio = np.linalg.norm(gaps, axis=2) * stiffness / np.linalg.norm(loads, axis=2)
    orders = [float(np.log(a / b) / np.log(4)) for a, b in pairwise(errors)]
    print("angle errors", " ".join(f"{e:.2e}" for e in errors), "rad")
    print("orders in 1/k", " ".join(f"{o:.2f}" for o in orders))
    print(f"gap times k over hinge force: {ratio.min():.3f} to {ratio.max():.3f}")
    assert errors[-1] < 1e-3
    assert all(0.95 < order < 1.05 for order in orders)
    assert ratio.min() > 0.95 and ratio.max() < 1.05


if __name__ == "__main__":
    main()
