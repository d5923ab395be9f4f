"""Stewart's platform driven by its legs.

Statements: (1) from rough angles the five loops close, by balls that are cut, with fifteen rows
that all count; the six drives leave no motion.  (2) The platform goes up and down as asked, and
level, within 1e-9 m and rad.  (3) All legs push alike, and with the rate of the energy of platform,
cylinders and pistons, written below in the height, over six times the rate of the legs.  (4) Legs
driven to six other lengths carry the platform to where its ends are these lengths from the feet.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
HEIGHT, STROKE, RATE = 0.9, 0.15, 4.0
REACH2 = 0.8**2 + 0.45**2 - 2 * 0.8 * 0.45 * np.cos(np.pi / 6)
#: Masses and inertias; centres: of a cylinder 0.2 m from its foot, of a piston 0.3 m from its head.
CYLINDER, PISTON, PLATFORM = (3.0, 0.04), (1.5, 0.045), 20.0
Array = NDArray[np.float64]


def height(t: Array) -> tuple[Array, Array]:
    """Of the platform and its rate."""
    return HEIGHT + STROKE * np.sin(RATE * t), STROKE * RATE * np.cos(RATE * t)


def energy(t: Array) -> Array:
    """Of all bodies, J: a leg of length l leans by an angle with tan = reach / height."""
    z, rate = height(t)
    length = np.sqrt(REACH2 + z**2)
    grows, leans = rate * z / length, rate * np.sqrt(REACH2) / length**2
    total = PLATFORM * (rate**2 / 2 + 9.81 * z)
    for (mass, inertia), at, along in ((CYLINDER, 0.2, 0.0), (PISTON, length - 0.3, grows)):
        kinetic = mass * (along**2 + (at * leans) ** 2) / 2 + inertia * leans**2 / 2
        total = total + 6 * (kinetic + 9.81 * mass * at * z / length)
    return total


def moved() -> float:
    """Largest error of the lengths of legs that carry the platform to a place and attitude."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    lengths = np.array([1.02, 0.99, 1.05, 1.0, 0.97, 1.03])
    for hinge in data["hinge"]:
        if hinge["type"] == "prismatic":
            hinge["drive"] = str(lengths[int(hinge["name"][-1])] - 0.6)
    result = mstmm.compile(mstmm.Scene(**data)).simulate(0.0)
    (w, *axis), place = result.orientation("platform")[0], result.position("platform")[0]
    ends = next(body["ends"] for body in data["body"] if body["name"] == "platform")
    heads = np.array([ends[f"head{k}"] for k in range(6)])
    heads = heads + 2 * np.cross(axis, np.cross(axis, heads) + w * heads) + place
    feet = [hinge["position"] for hinge in data["hinge"] if hinge["type"] == "universal"]
    found = np.linalg.norm(heads - np.array(feet), axis=1)
    print(f"platform at {np.round(place, 3)} m")
    return float(np.abs(found - lengths).max())


def main() -> None:
    """All four statements."""
    model = mstmm.compile(mstmm.load_scene(SCENE))
    loops = model.loops
    print(
        f"cut: {', '.join(loops.cut_hinges)}; {loops.rank} of {len(loops.constraint_rows)} rows "
        f"count"
    )
    assert (len(loops.cut_hinges), len(loops.constraint_rows), loops.rank, loops.mobility) == (
        5,
        15,
        15,
        0,
    )

    times = np.linspace(0.0, 2.0, 201)
    result = model.simulate(2.0, rtol=1e-8, output_times=times)
    assert result.success, result.message
    place = result.position("platform") - np.outer(height(times)[0], [0, 0, 1])
    turned = 2 * result.orientation("platform")[:, 1:]
    print(f"off by {np.abs(place).max():.1e} m, turned by {np.abs(turned).max():.1e}")
    assert np.abs(place).max() < 1e-9
    assert np.abs(turned).max() < 1e-9

    efforts = np.array([result.quantity(f"slide{k}.effort").values for k in range(6)])
    z, rate = height(times)
    step = 1e-4
    power = (energy(times + step) - energy(times - step)) / (2 * step)
    grows = rate * z / np.sqrt(REACH2 + z**2)
    moving = np.abs(rate) > 0.1
    wanted = power[moving] / (6 * grows[moving])
    error = np.abs(efforts[:, moving] - wanted).max() / np.abs(wanted).max()
    print(f"legs push {efforts.min():.1f} to {efforts.max():.1f} N, off by {error:.1e}")
    assert np.ptp(efforts, axis=0).max() < 1e-8 * efforts.max()
    assert error < 1e-6

    error = moved()
    print(f"lengths of legs after a move: off by {error:.1e} m")
    assert error < 1e-12


if __name__ == "__main__":
    main()
