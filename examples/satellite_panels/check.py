"""A satellite with two flexible panels: coupled frequencies by formula, momenta through a slew.

Statements: (1) the frequencies of the motion linearised about rest are the roots of characteristic
equations, written below, of a rigid body with two beams: bending in two planes with the hub turning
or shifting, twist with the hub turning.  (2) While wheels turn everything in space, momentum stays
zero, angular momentum is the integral of their torque, turned with the hub, and the energy is
their work.  (3) Afterwards the panels go on swinging, and angular momentum stays.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
LENGTH, MASS, POLAR, TORSION, ARM = 4.0, 2.0, 0.3, 100.0, 0.5
BENDING = {"z": 200.0, "y": 2000.0}
HUB, INERTIA = 120.0, {"x": 30.0, "y": 25.0, "z": 40.0}
#: About y and z the sections of both panels turn with the floating frames: half of POLAR each.
SECTIONS = 2 * LENGTH * POLAR / 2
Array = NDArray[np.float64]


def bending(omega: float, stiffness: float, inertia: float, mass: float) -> float:
    """Determinant of a clamped-free beam on the hub, zero at a frequency (rad/s).

    Unknowns A cosh + B sinh + C cos + D sin of beta s and the motion h of the hub: a turn with
    `inertia` (then `mass` is 0), Y(0) = ARM h, Y'(0) = h, or a shift with `mass`, Y(0) = h.
    """
    beta = (MASS * omega**2 / stiffness) ** 0.25
    x = beta * LENGTH
    ch, sh, c, s = np.cosh(x), np.sinh(x), np.cos(x), np.sin(x)
    turns = 1.0 if inertia else 0.0
    root_moment = 2 * stiffness * beta**2 * np.array([1.0, 0, -1, 0])  # EI Y''(0), both panels
    root_force = -2 * stiffness * beta**3 * np.array([0.0, 1, 0, -1])  # on the hub, -EI Y'''(0)
    if turns:
        hub = [*(root_moment + ARM * root_force), omega**2 * inertia]
    else:
        hub = [*root_force, omega**2 * mass]
    rows = np.array([
        [1.0, 0, 1, 0, -(ARM if turns else 1.0)],
        [0.0, beta, 0, beta, -turns],
        [ch, sh, -c, -s, 0.0],
        [sh, ch, s, -c, 0.0],
        hub,
    ])  # fmt: skip
    return float(np.linalg.det(rows) / ch)


def twist(omega: float) -> float:
    """Zero at a frequency of both panels twisting on the hub."""
    k = omega * np.sqrt(POLAR / TORSION)
    x = k * LENGTH
    hub = omega**2 * INERTIA["x"]
    return float(hub * np.cos(x) + 2 * TORSION * k * np.sin(x))


def opposite(omega: float) -> float:
    """Zero at a frequency of the panels twisting against each other: the hub rests."""
    return float(np.cos(omega * np.sqrt(POLAR / TORSION) * LENGTH))


def roots(function: Callable[[float], float], count: int) -> list[float]:
    """The first positive ones."""
    grid = np.arange(0.3, 80.0, 0.05)
    values = [function(w) for w in grid]
    places = [k for k in range(len(grid) - 1) if values[k] * values[k + 1] < 0]
    return [float(brentq(function, grid[k], grid[k + 1], xtol=1e-12)) for k in places[:count]]


def check_frequencies(model: mstmm.Model) -> None:
    """Statement 1."""
    A = model.derivatives(*model.initial_state()).state_matrix
    found = np.linalg.eigvals(A)
    assert abs(found.real).max() < 1e-5
    frequencies = np.unique(np.round(found.imag[found.imag > 0.1], 9))
    families: dict[str, Callable[[float], float]] = {
        "turn about y": lambda w: bending(w, BENDING["z"], INERTIA["y"] + SECTIONS, 0.0),
        "shift along z": lambda w: bending(w, BENDING["z"], 0.0, HUB),
        "turn about z": lambda w: bending(w, BENDING["y"], INERTIA["z"] + SECTIONS, 0.0),
        "shift along y": lambda w: bending(w, BENDING["y"], 0.0, HUB),
        "turn about x": twist, "twist, opposite": opposite,
    }  # fmt: skip
    for name, function in families.items():
        exact = roots(function, 2)
        nearest = [float(frequencies[np.argmin(abs(frequencies - w))]) for w in exact]
        off = [abs(a / b - 1) for a, b in zip(nearest, exact, strict=True)]
        print(f"{name:16} {exact[0]:9.5f} {exact[1]:9.5f} rad/s, off {off[0]:.1e} {off[1]:.1e}")
        assert off[0] < 1e-4 and off[1] < 1e-3, name


def turned(quaternions: Array, vectors: Array) -> Array:
    """Vectors from hub to inertial axes."""
    w, v = quaternions[:, :1], quaternions[:, 1:]
    across = np.cross(v, vectors)
    return np.asarray(vectors + 2 * w * across + 2 * np.cross(v, across))


def check_slew(model: mstmm.Model) -> None:
    """Statements 2 and 3."""
    t = np.linspace(0.0, 12.0, 2401)
    result = model.simulate(t_end=12.0, rtol=1e-8, atol=1e-10, output_times=t)
    assert result.success, result.message
    profile = np.where(t < 8, np.sin(np.pi * t / 4), 0.0)
    torque = turned(result.orientation("hub"), profile[:, None] * np.array([3.0, 2.0, 8.0]))
    supplied = cumulative_simpson(torque, x=t, axis=0, initial=0.0)
    L = result.angular_momentum()
    spun = float(abs(L - supplied).max())
    power = np.einsum("ij,ij->i", torque, result.angular_velocity("hub"))
    work = cumulative_simpson(power, x=t, initial=0.0)
    energy = result.energy() - result.energy()[0]
    slow = t >= 8
    rest = float(np.ptp(L[slow], axis=0).max())
    arm = result.position("east.tip") - result.position("hub.right")
    back = result.orientation("hub") * [1, -1, -1, -1]
    bent = abs(turned(back, arm)[slow, 1:]).max(axis=0)
    angle = 2 * np.arccos(np.clip(abs(result.orientation("hub")[-1, 0]), 0, 1))
    print(f"turned by {np.degrees(angle):.1f} degrees; tips swing by {bent.round(4)} m afterwards")
    print(f"momentum {abs(result.momentum()).max():.1e} N s; angular momentum less torque ", end="")
    print(f"{spun:.1e} of {abs(supplied).max():.1f} N m s, later {rest:.1e}; ", end="")
    print(f"energy less work {abs(energy - work).max():.1e} of {energy.max():.2f} J")
    assert abs(result.momentum()).max() < 1e-7 and rest < 1e-7
    assert spun < 1e-5 and abs(energy - work).max() < 1e-5
    assert np.degrees(angle) > 10 and bent.max() > 1e-3


def main() -> None:
    """All statements."""
    model = mstmm.compile(mstmm.load_scene(SCENE), engine="looped")
    check_frequencies(model)
    check_slew(model)


if __name__ == "__main__":
    main()
