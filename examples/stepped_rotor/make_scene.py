"""Write scene.toml: the rotor of Nelson and McVaugh (1976) as 18 beams with constant sections.

python examples/stepped_rotor/make_scene.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import mstmm

#: Young's modulus (N/m2) and density (kg/m3).
YOUNG, DENSITY = 2.078e11, 7806.0
#: Stations along the shaft (m); inner and outer radii between them (m).
STATIONS = 1e-2 * np.array([0, 1.27, 5.08, 7.62, 8.89, 10.16, 10.67, 11.43, 12.70, 13.46, 16.51,
                            19.05, 22.86, 26.67, 28.70, 30.48, 31.50, 34.54, 35.5])  # fmt: skip
INNER = 1e-2 * np.array([0, 0, 0, 0, 0, 0, 1.52, 1.78, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1.52])
OUTER = 1e-2 * np.array([0.51, 1.02, 0.76, 2.03, 2.03, 3.30, 3.30, 2.54, 2.54, 1.27, 1.27, 1.52,
                         1.52, 1.27, 1.27, 3.81, 2.03, 2.03])  # fmt: skip
LENGTHS, AREAS = np.diff(STATIONS), np.pi * (OUTER**2 - INNER**2)
SECOND_MOMENTS = np.pi * (OUTER**4 - INNER**4) / 4
#: Station of the disc, its mass (kg) and moments of inertia along and across the axis (kg m2).
DISC_STATION, MASS, POLAR, ACROSS = 4, 1.401, 0.00203, 0.00136
#: Stations of the bearings, and their stiffness along y and z (N/m).
BEARINGS, STIFFNESS = (10, 14), 4.378e7


def scene() -> mstmm.Scene:
    """A chain of beams on two bearings; its first station may go along y and z, and tilt."""
    light: dict[str, Any] = {"mass": 1e-6, "inertia": [1e-10] * 3}
    carriers = [{"name": name, **light} for name in ("slide", "carrier", "spindle")]
    disc = {"name": "disc", "mass": MASS, "inertia": [POLAR, ACROSS, ACROSS]}
    beams, hinges = [], []
    for k, (length, area, moment) in enumerate(zip(LENGTHS, AREAS, SECOND_MOMENTS, strict=True), 1):
        bending, rotary = YOUNG * moment, DENSITY * moment
        beams.append({
            "name": f"s{k}", "length": length, "mass_per_length": DENSITY * area,
            "bending_stiffness": [bending, bending], "rotary_inertia": [rotary, rotary],
            "polar_inertia_per_length": 2 * rotary, "modes": {"y": 2, "z": 2},
            "basis": "static+fixed-interface",
        })  # fmt: skip
        if k > 1:
            hinges.append({"name": f"weld{k}", "type": "fixed", "inboard": f"s{k - 1}.tip",
                           "outboard": f"s{k}"})  # fmt: skip
    root = [
        {"name": "y", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
         "outboard": "slide"},
        {"name": "z", "type": "prismatic", "axis": [0, 0, 1], "inboard": "slide",
         "outboard": "carrier"},
        {"name": "spin", "type": "pin", "axis": [1, 0, 0], "inboard": "carrier",
         "outboard": "spindle", "drive": "spin*t"},
        {"name": "tilt", "type": "universal", "axis": [0, 1, 0], "axis2": [0, 0, 1],
         "inboard": "spindle", "outboard": "s1"},
    ]  # fmt: skip
    hub = {"name": "hub", "type": "fixed", "inboard": f"s{DISC_STATION}.tip", "outboard": "disc"}
    bearings = [
        {"name": f"bearing{k}", "from": "ground", "to": f"s{station}.tip", "conservative": False,
         "position": [STATIONS[station], 0, 0], "stiffness": [[STIFFNESS, 0], [0, STIFFNESS]]}
        for k, station in enumerate(BEARINGS, 1)
    ]  # fmt: skip
    return mstmm.Scene(
        gravity=[0, 0, 0], constants={"spin": 0.0}, body=[*carriers, disc], beam=beams,
        hinge=[*root, *hinges, hub], bushing=bearings,
    )  # fmt: skip


if __name__ == "__main__":
    Path(__file__).with_name("scene.toml").write_text(scene().to_toml())
