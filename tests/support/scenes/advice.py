"""Scenes that are reduced in tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import mstmm

#: Inertia of the hub, bending stiffness, period and torque.
HUBS: dict[str, tuple[float, float, float, float]] = {
    "A": (5.0, 400.0, 1.5, 20.0),
    "B": (5.0, 20.0, 1.2, 8.0),
    "C": (0.2, 20.0, 1.2, 1.0),
    "D": (0.5, 2.0, 3.0, 2.4),
}
TIP = "arm.tip.position"


def hub_and_beam(name: str, shapes: int = 3, **beam: Any) -> mstmm.Scene:
    """A hub with a clamped beam, pushed by one period of a torque."""
    inertia, bending, period, torque = HUBS[name]
    effort = f"where(t < {period}, {torque} * sin(2 * pi * t / {period}), 0)"
    return mstmm.Scene(
        gravity=[0, 0, 0],
        body=[{"name": "hub", "mass": 1.0, "inertia": [inertia] * 3}],
        beam=[{
            "name": "arm", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": bending,
            "modes": {"y": shapes}, "frame": "tangent", "basis": "clamped-free", **beam,
        }],
        hinge=[
            {"name": "axle", "type": "pin", "inboard": "ground", "outboard": "hub",
             "law": {"effort": effort}},
            {"name": "root", "type": "fixed", "inboard": "hub", "outboard": "arm"},
        ],
    )  # fmt: skip


def hub_and_pieces(name: str, count: int, **more: Any) -> mstmm.Scene:
    """The same with the beam in welded pieces, which have frames of their own."""
    whole = hub_and_beam(name).model_dump(by_alias=True, exclude_none=True)
    beam = {"length": 1 / count, "mass_per_length": 1.0, "bending_stiffness": HUBS[name][1],
            "modes": {"y": 2}, **more}  # fmt: skip
    names = [f"piece{k}" for k in range(count - 1)] + ["arm"]
    welds = [
        {"name": f"weld{k}", "type": "fixed", "inboard": f"{a}.tip" if k else "hub", "outboard": b}
        for k, (a, b) in enumerate(zip(["", *names], names, strict=False))
    ]
    beams = [beam | {"name": one} for one in names]
    return mstmm.Scene(**whole | {"beam": beams, "hinge": [whole["hinge"][0], *welds]})


def period(name: str) -> float:
    """End of the run, s: two periods of the torque."""
    return 2 * HUBS[name][2]


def two_beams() -> mstmm.Scene:
    """A stiff boom on a pin, a soft lash on a ball behind it: a double pendulum in a plane."""
    beam = {"polar_inertia_per_length": 1e-4}
    return mstmm.Scene(
        gravity=[0, -9.81, 0],
        beam=[
            beam | {"name": "boom", "length": 1.0, "mass_per_length": 1.0,
                    "bending_stiffness": 3e4, "modes": {"y": 2, "z": 1}},
            beam | {"name": "lash", "length": 0.8, "mass_per_length": 0.5,
                    "bending_stiffness": 6.0, "modes": {"y": 2}},
        ],
        hinge=[
            {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "boom"},
            {"name": "elbow", "type": "ball", "inboard": "boom.tip", "outboard": "lash"},
        ],
    )  # fmt: skip


def tip(scene: mstmm.Scene, t_end: float, name: str = TIP, **options: Any) -> NDArray[np.float64]:
    """(201, 3) places of the tip by a run of its own."""
    model = mstmm.compile(scene, engine="looped")
    given = options or {"rtol": 1e-10, "atol": 1e-12}
    result = model.simulate(t_end, output_times=np.linspace(0, t_end, 201), **given)
    assert result.success
    return result.quantity(name).values


def sprung_rods(stiffness: float, damping: float = 1e-9) -> mstmm.Scene:
    """Four rods in a row: a pin with a damper, a sprung pin, a bushing and a slide."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.001, 0.084, 0.084],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    law = {"stiffness": [1e7] * 3 + [1e6] * 3, "damping": [1e2] * 6}
    return mstmm.Scene(
        gravity=[0, -9.81, 0],
        body=[rod | {"name": name} for name in ("a", "b", "c", "d")],
        hinge=[
            {"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "a",
             "law": {"damping": damping}},
            {"name": "spring", "type": "pin", "inboard": "a.tip", "outboard": "b",
             "law": {"stiffness": stiffness, "rest": 0.4, "damping": 10.0},
             "initial": {"q": [0.4]}},
            {"name": "bushing", "type": "elastic", "inboard": "b.tip", "outboard": "c",
             "law": law},
            {"name": "slide", "type": "prismatic", "axis": [0, 0, 1], "inboard": "c.tip",
             "outboard": "d", "law": {"stiffness": 1e3, "damping": 1.0}},
        ],
    )  # fmt: skip
