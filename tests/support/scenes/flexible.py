"""Scenes that the tests of flexible bodies share: dictionaries in the shape of the scene file."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tests.support.models import compile_scene

Array = npt.NDArray[np.float64]
Scene = dict[str, Any]

#: Step of numerical differentiation, m and rad: deflections of this size are linear.
STEP = 2e-5


def beam(name: str, length: float = 1.0, stiffness: Any = 1.0, **keys: Any) -> Scene:
    """A [[beam]] of 1 kg/m, tangent frame, clamped-free shapes, inertia in its invariant form."""
    given = {
        "name": name,
        "length": length,
        "mass_per_length": 1.0,
        "bending_stiffness": stiffness,
        "frame": "tangent",
        "basis": "clamped-free",
        "quadrature": False,
    }
    return given | keys


def hinge(name: str, kind: str, inboard: str, outboard: str, **keys: Any) -> Scene:
    """A [[hinge]]."""
    return {"name": name, "type": kind, "inboard": inboard, "outboard": outboard} | keys


def scene(*parts: Scene, gravity: Any = (0.0, 0.0, 0.0), load: Any = ()) -> Scene:
    """Bodies, beams and hinges, told apart by their keys, in a scene."""
    return {
        "gravity": list(gravity),
        "body": [part for part in parts if "mass" in part],
        "beam": [part for part in parts if "length" in part],
        "hinge": [part for part in parts if "type" in part],
        "load": list(load),
    }


def turning_beam(spin: float, hub: float = 0.0, **keys: Any) -> Scene:
    """A unit beam clamped to the rim of a hub that is driven about z with a constant `spin`."""
    ends = {"rim": [hub, 0.0, 0.0]}
    return scene(
        {"name": "hub", "mass": 1.0, "inertia": [1.0, 1.0, 1.0], "ends": ends},
        beam("blade", polar_inertia_per_length=1e-3, **keys),
        hinge("drive", "pin", "ground", "hub", drive=f"{spin!r}*t"),
        hinge("clamp", "fixed", "hub.rim", "blade"),
    )


def motion_near(data: Scene, exact: bool = False) -> tuple[Array, Array]:
    """A_q, A_u: derivatives of the free accelerations by free coordinates and speeds at the start.

    Of pins, planar hinges and modes only.  By differences of the looped engine, or exactly, which
    compiles a kernel of its own (minutes for many shapes).
    """
    model = compile_scene(data, "fused" if exact else "looped")
    q, u = model.initial_state()
    driven = [one for one in data["hinge"] if "drive" in one]
    free = np.arange(len(driven), len(u))  # driven hinges come first in these scenes
    if exact:
        found = model.derivatives(q, u)
        return found.q[np.ix_(free, free)], found.u[np.ix_(free, free)]

    def slopes(by_q: float, by_u: float) -> Array:
        steps = np.eye(len(u))[free] * STEP
        rate = np.zeros((len(steps), len(u)))
        for k, weight in ((1, 8), (-1, -8), (2, -1), (-2, 1)):
            rate += weight * model.accelerations(q + k * by_q * steps, u + k * by_u * steps)
        return np.asarray(rate[:, free].T / (12 * STEP))

    return slopes(1.0, 0.0), slopes(0.0, 1.0)


def frequencies(by_q: Array, by_u: Array, count: int) -> Array:
    """Lowest frequencies of udot = A_q dq + A_u du in rad/s, without zeros."""
    n = len(by_q)
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [by_q, by_u]])
    roots = np.linalg.eigvals(matrix)
    return np.sort(roots.imag[roots.imag > 1e-6])[:count]


def spin_up(speed: float, duration: float = 15.0) -> str:
    """Angle of omega = speed (t/T - sin(2 pi t/T)/(2 pi)) up to T, constant from there, as text."""
    w = f"(2*pi/{duration})"
    rising = f"{speed / duration!r}*(t^2/2 + (cos({w}*t) - 1)/{w}^2)"
    return f"where(t < {duration}, {rising}, {speed}*(t - {duration / 2}))"


def javelin(frame: str, basis: str, n: int, **keys: Any) -> Scene:
    """A javelin thrown by its mid section for a second: 2 m, 1 kg, EI = 150 N m^2."""
    path = ["7.5*t^2", "10.5*t^2 - 1.96875*t^4", "atan(1.4 - 0.525*t^2)"]
    body = beam(
        "javelin", 2.0, 150.0, mass_per_length=0.5, frame=frame, basis=basis, modes={"y": n},
        ends={"mid": 1.0}, **keys,
    )  # fmt: skip
    hand = hinge(
        "hand", "planar", "ground", "javelin.mid", axis=[0, 0, 1], axis2=[1, 0, 0],
        drive=path, release="t >= 1",
    )  # fmt: skip
    return scene(body, hand, gravity=(0.0, -9.81, 0.0))
