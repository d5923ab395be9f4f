"""Scenes for the classical discrete-time method."""

from __future__ import annotations

from typing import Any

import numpy as np

import mstmm


def rods(count: int, kind: str = "pin", law: dict[str, Any] | None = None) -> mstmm.Scene:
    """Rods of 1 m and 1 kg along x in a row, at rest, under gravity along -y."""
    hinge = {"type": kind} | ({"axis": [0, 0, 1]} if kind == "pin" else {})
    return mstmm.Scene(
        gravity=[0, -9.81, 0],
        body=[
            {
                "name": f"rod{i}", "mass": 1.0, "center_of_mass": [0.5, 0, 0],
                "inertia": [0.01, 1 / 12, 1 / 12], "ends": {"tip": [1, 0, 0]},
            }
            for i in range(count)
        ],
        hinge=[
            {
                "name": f"h{i}", **hinge, "outboard": f"rod{i}",
                "inboard": "ground" if i == 0 else f"rod{i - 1}.tip",
                **({} if law is None else {"law": law}),
            }
            for i in range(count)
        ],
    )  # fmt: skip


def spinning_rods() -> mstmm.Scene:
    """The rods on balls of `reference.rods_index3`."""
    spins = np.array([[2.0, 0.0, 1.5], [-1.0, 1.0, 0.5]])
    relative = [spins[0], spins[1] - spins[0]]
    return mstmm.Scene(
        gravity=[0, 0, -9.81],
        body=[
            {
                "name": f"rod{i}", "mass": 1.0, "center_of_mass": [0.5, 0, 0],
                "inertia": [0.01, 0.09, 0.09], "ends": {"tip": [1, 0, 0]},
            }
            for i in range(2)
        ],
        hinge=[
            {
                "name": f"h{i}", "type": "ball", "outboard": f"rod{i}",
                "inboard": "ground" if i == 0 else f"rod{i - 1}.tip",
                "initial": {"q": [1, 0, 0, 0], "u": relative[i].tolist()},
            }
            for i in range(2)
        ],
    )  # fmt: skip


def tree(kinds: list[str]) -> mstmm.Scene:
    """Six bodies with three branches, whose hinges are of these kinds by turns; all moving."""
    rng = np.random.default_rng(1)
    bodies, hinges = [], []
    for i, parent in enumerate((-1, 0, 1, 1, 0, 4)):
        bodies.append({
            "name": f"b{i}", "mass": rng.uniform(0.5, 2),
            "center_of_mass": rng.normal(0, 0.2, 3).tolist(),
            "inertia": rng.uniform(0.1, 0.15, 3).tolist(),
            "ends": {
                "a": rng.normal(0, 0.4, 3).tolist(),
                "b": {
                    "position": rng.normal(0, 0.4, 3).tolist(),
                    "orientation": rng.normal(0, 0.5, 3).tolist(),
                },
            },
        })  # fmt: skip
        kind = kinds[i % len(kinds)]
        inboard = "ground" if parent < 0 else f"b{parent}.{'ab'[i % 2]}"
        hinges.append(
            {"name": f"h{i}", "type": kind, "inboard": inboard, "outboard": f"b{i}"}
            | _moving(kind, rng)
        )
    return mstmm.Scene(gravity=[0, -1, -9.81], body=bodies, hinge=hinges)


def _moving(kind: str, rng: np.random.Generator) -> dict[str, Any]:
    spin = rng.normal(0, 0.5, 6).tolist()
    six = {"q": [0.01, 0, 0, 1, 0, 0, 0], "u": spin}
    law: dict[str, list[float]] = {
        "stiffness": [300, 200, 250, 30, 20, 25], "damping": [5, 5, 5, 0.3, 0.2, 0.1],
    }  # fmt: skip
    found: dict[str, dict[str, Any]] = {
        "fixed": {},
        "pin": {"axis": rng.normal(size=3).tolist(), "initial": {"q": [0.3], "u": spin[:1]}},
        "ball": {"initial": {"q": [1, 0, 0, 0], "u": spin[:3]}},
        "free": {"initial": six},
        "elastic": {"initial": six, "law": law},
        "sprung pin": {"type": "elastic", "initial": six, "law": _without_turns(law, 1)},
        "sprung ball": {"type": "elastic", "initial": six, "law": _without_turns(law, 3)},
    }
    return found[kind]


def _without_turns(law: dict[str, list[float]], count: int) -> dict[str, list[float]]:
    """Springs and dampers of an elastic hinge, but none about its last axes."""
    return {name: [*values[: 6 - count], *[0.0] * count] for name, values in law.items()}


_SPRINGS: dict[str, list[float]] = {
    "stiffness": [500, 400, 450, 30, 20, 25], "damping": [5, 5, 5, 0.3, 0.2, 0.1],
}  # fmt: skip
_HELD: dict[str, dict[str, Any]] = {
    "pin": {"axis": [0, 0, 1], "initial": {"q": [0.1], "u": [1.0]}},
    "ball": {"initial": {"q": [1, 0, 0, 0], "u": [0.3, 0.4, 0.5]}},
    "fixed": {},
    "elastic": {
        "law": _SPRINGS, "initial": {"q": [0, 0, 0, 1, 0, 0, 0], "u": [0, 0, 0, 0.1, 0.1, 0.2]},
    },
}  # fmt: skip
_HELD["sprung pin"] = _HELD["elastic"] | {"type": "elastic", "law": _without_turns(_SPRINGS, 1)}
_AT_TIP: dict[str, dict[str, Any]] = {
    "pin": {"axis": [0.2, 0.3, 1], "initial": {"q": [0.3], "u": [1.0]}},
    "ball": {"initial": {"q": [1, 0, 0, 0], "u": [0.1, 0.2, 0.4]}},
    "fixed": {},
    "elastic": {"law": _SPRINGS},
    "sprung pin": {
        "type": "elastic",
        "law": _without_turns(_SPRINGS, 1),
        "initial": {"q": [0, 0, 0, 1, 0, 0, 0], "u": [0, 0, 0, 0.1, 0.2, 0.4]},
    },
}


def beam(name: str, modes: dict[str, int], **keys: Any) -> dict[str, Any]:
    """A beam of 1 m and 1 kg, tangent to its root, without stiffening."""
    return {
        "name": name, "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": [50.0, 75.0],
        "polar_inertia_per_length": 1e-2, "torsional_stiffness": 50.0, "modes": modes,
        "frame": "tangent", "stiffening": False,
    } | keys  # fmt: skip


def held_beam(kind: str, at_tip: str = "", outboard: str = "rigid") -> mstmm.Scene:
    """A beam in space on a hinge; on its tip, by another hinge, a rigid body or a beam."""
    both = {"y": 1, "z": 1}
    hinges = [{"name": "h0", "type": kind, "inboard": "ground", "outboard": "a"} | _HELD[kind]]
    beams, bodies = [beam("a", both)], []
    if at_tip:
        second = {"name": "h1", "type": at_tip, "inboard": "a.tip", "outboard": "b"}
        hinges.append(second | _AT_TIP[at_tip])
        if outboard == "beam":
            beams.append(beam("b", both))
        else:
            bodies.append(
                {
                    "name": "b", "mass": 0.5, "center_of_mass": [0.2, 0.1, 0.1],
                    "inertia": [0.02, 0.03, 0.04],
                }
            )  # fmt: skip
    return mstmm.Scene(gravity=[0, -2, -9.81], beam=beams, body=bodies, hinge=hinges)
