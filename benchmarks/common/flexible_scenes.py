"""Data and scenes of the two flexible systems."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

Array = np.ndarray
GRAVITY = 9.81


class Spin:
    """A beam spun up about its root (Simo and Vu-Quoc, J. Appl. Mech. 53 (1986) 855-863)."""

    LENGTH, RATE, PERIOD, T_END = 10.0, 6.0, 15.0, 20.0
    BEAM: ClassVar = {
        "mass_per_length": 1.2, "bending_stiffness": 1.4e4, "axial_stiffness": 2.8e7,
    }  # fmt: skip
    #: Largest deflection of the tip across the rotating axis (m) and its time (s): geometrically
    #: exact, inextensible, spectral (tests/reference/flexible/inextensible.py).
    LARGEST, LARGEST_TIME = -0.57375, 6.762
    ANGLE_EXPRESSION = (
        "where(t < 15, 0.4*(t^2/2 + (15/(2*pi))^2*(cos(2*pi*t/15) - 1)), 6*(t - 7.5))"
    )

    @classmethod
    def angle(cls, t: Array) -> Array:
        """Angle of the root, rad."""
        period_part = cls.PERIOD / (2 * np.pi)
        spin_up_angle = (
            cls.RATE / cls.PERIOD * (t**2 / 2 + period_part**2 * (np.cos(t / period_part) - 1))
        )
        return np.where(t < cls.PERIOD, spin_up_angle, cls.RATE * (t - cls.PERIOD / 2))

    @classmethod
    def scene(cls, modes: int, **keys: Any) -> dict[str, Any]:
        """Scene with bending in the plane only."""
        beam = {
            "name": "blade", "length": cls.LENGTH,
            "mass_per_length": cls.BEAM["mass_per_length"],
            "bending_stiffness": cls.BEAM["bending_stiffness"], "modes": {"y": modes}, **keys,
        }  # fmt: skip
        hinge = {
            "name": "motor", "type": "pin", "inboard": "ground", "outboard": "blade",
            "axis": [0, 0, 1], "drive": cls.ANGLE_EXPRESSION,
        }  # fmt: skip
        return {"gravity": [0, 0, 0], "beam": [beam], "hinge": [hinge]}


class Strip:
    """Steel strips, 100 mm x 100 mm x 0.1 mm, on pins: a chain that swings."""

    LENGTH, INITIAL_SLOPE, T_END = 0.1, np.pi / 4, 3.0
    BEAM: ClassVar = {
        "mass_per_length": 0.0785, "bending_stiffness": 1.75e-3, "axial_stiffness": 2.1e6,
    }  # fmt: skip

    @classmethod
    def chain(cls, count: int, modes: int, **keys: Any) -> dict[str, Any]:
        """Scene with bending in the plane only."""
        beams, hinges = [], []
        for i in range(count):
            beams.append({
                "name": f"strip{i}", "length": cls.LENGTH,
                "mass_per_length": cls.BEAM["mass_per_length"],
                "bending_stiffness": cls.BEAM["bending_stiffness"], "modes": {"y": modes}, **keys,
            })  # fmt: skip
            hinge = {"name": f"pin{i}", "type": "pin", "outboard": f"strip{i}", "axis": [0, 0, 1]}
            hinge["inboard"] = f"strip{i - 1}.tip" if i else "ground"
            if not i:
                hinge["orientation"] = [0, 0, -cls.INITIAL_SLOPE]
            hinges.append(hinge)
        return {"gravity": [0, -GRAVITY, 0], "beam": beams, "hinge": hinges}
