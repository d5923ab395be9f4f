"""Converged motions of inextensible beams, kept in converged.json for the tests.

    python -m tests.reference.flexible.record          (about ten minutes)

Chains of 8, 16 and 32 rigid segments per beam, extrapolated; `correction` is the last step of the
extrapolation, over all times.  Spin-ups and the javelin by the spectral form.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .inextensible import Array, Beam, Chain, extrapolated_limit, segments, spectral, spin_up

FILE = Path(__file__).with_name("converged.json")
GRAVITY = 9.81

#: Beams, end of the motion and number of intervals of each released chain; all start at rest.
RELEASED: dict[str, tuple[list[Beam], float, int]] = {
    "pendulum": ([Beam(1.0, 5.0)], 1.0, 20),
    "two pinned": ([Beam(0.6, 5.0), Beam(0.5, 5.0)], 1.0, 20),
    "welded": ([Beam(0.6, 50.0), Beam(0.5, 50.0, joint="weld", angle=np.pi / 2)], 0.5, 10),
}

SIMO = Beam(10.0, 1.4e4, 1.2)
KANE = Beam(8.0, 6.8952e10 * 8.2189e-9, 2766.67 * 7.2968e-5)
SPIN_UPS = {"simo": (SIMO, 6.0), "kane 4": (KANE, 4.0), "kane 6": (KANE, 6.0)}


def peak(chain: Chain, speed: float, end: float = 8.0) -> dict[str, Any]:
    """Largest deflection of the tip across the turning base, its time, the largest shortening."""
    base = spin_up(speed)
    turning, times = chain.with_driven_base(base), np.linspace(0.0, end, 1601)
    a, _ = turning.run(times, 1e-9)
    angle = np.array([base(t)[0] for t in times])
    x, y = np.array([turning.position(t, row) for t, row in zip(times, a, strict=True)]).T
    along, across = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
    i = int(across.argmin())
    local = np.polynomial.Polynomial.fit(times[i - 4 : i + 5], across[i - 4 : i + 5], 5)
    roots = local.deriv().roots()
    t = float(min(roots[np.isreal(roots)].real, key=lambda r: abs(r - times[i])))
    shortening = float(along.min() - chain.tip.sum())
    samples = across[::40].tolist()  # every 0.2 s
    return {"deflection": float(local(t)), "time": t, "shortening": shortening, "across": samples}


def released_motion(beams: list[Beam], end: float, count: int) -> dict[str, Any]:
    """Tip over time, extrapolated."""
    times = np.linspace(0.0, end, count + 1)
    tips: list[Array] = [segments(beams, n, GRAVITY).tips(times) for n in (8, 16, 32)]
    limit, correction = extrapolated_limit(tips)
    return {"t": times.tolist(), "tip": limit.tolist(), "correction": correction}


def javelin_release(order: int) -> dict[str, float]:
    """The javelin's equivalent velocity, spin and mass centre after a second in the hand.

    Two halves of 1 m, 0.5 kg/m and 150 N m^2 that begin at the driven mid section.
    """

    def hand(t: float) -> tuple[float, float, float]:
        tangent, rate, second = 1.4 - 0.525 * t * t, -1.05 * t, -1.05
        square = 1 + tangent**2
        turning = second / square - 2 * tangent * rate**2 / square**2
        return float(np.arctan(tangent)), rate / square, turning

    def lift(t: float) -> tuple[float, float]:
        return 15.0, 21.0 - 12 * 1.96875 * t * t

    masses, places, velocities = [], [], []
    for turned in (0.0, np.pi):
        half = Beam(1.0, 150.0, 0.5, angle=turned)
        chain = replace(
            spectral([half], order, 9.81, clamped=True).with_driven_base(hand), lift=lift
        )
        a, rates = chain.run([0.0, 1.0], 1e-8)
        mass, place, velocity = chain.particles(1.0, a[-1], rates[-1])
        masses.append(mass)
        places.append(place)
        velocities.append(velocity)
    mass, place, velocity = (np.concatenate(x) for x in (masses, places, velocities))
    place = place + np.array([7.5, 10.5 - 1.96875])
    velocity = velocity + np.array([15.0, 21.0 - 4 * 1.96875])
    center, mean = mass @ place / mass.sum(), mass @ velocity / mass.sum()
    x, y = (place - center).T
    spin = mass @ (x * velocity[:, 1] - y * velocity[:, 0]) / (mass.sum() * 4 / 12)
    found = [*mean, spin, *center]
    return dict(zip(("vx", "vy", "spin", "x", "y"), map(float, found), strict=True))


def main() -> None:
    """Compute everything and write the file."""
    record: dict[str, Any] = {name: released_motion(*case) for name, case in RELEASED.items()}
    for name, (beam, speed) in SPIN_UPS.items():
        record[name] = peak(spectral([beam], 7, clamped=True), speed)
    record["javelin"] = javelin_release(6)
    FILE.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
