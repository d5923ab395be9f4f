"""Converged motions of inextensible beams, kept in converged.json for the tests.

    python -m flexible.reference.record          (in tests/; about five minutes)

Chains of 8, 16 and 32 rigid segments per beam, extrapolated; `correction` is the last step of the
extrapolation, over all times.  Spin-ups by the spectral form.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from .inextensible import Array, Beam, Chain, extrapolated, segments, spectral, spin_up

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
    turning, times = chain.driven(base), np.linspace(0.0, end, 1601)
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


def released(beams: list[Beam], end: float, count: int) -> dict[str, Any]:
    """Tip over time, extrapolated."""
    times = np.linspace(0.0, end, count + 1)
    tips: list[Array] = [segments(beams, n, GRAVITY).tips(times) for n in (8, 16, 32)]
    limit, correction = extrapolated(tips)
    return {"t": times.tolist(), "tip": limit.tolist(), "correction": correction}


def main() -> None:
    """Compute everything and write the file."""
    record: dict[str, Any] = {name: released(*case) for name, case in RELEASED.items()}
    for name, (beam, speed) in SPIN_UPS.items():
        record[name] = peak(spectral([beam], 7, clamped=True), speed)
    FILE.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
