"""A coupler curve, and what turns the crank.

Statements: (1) the tip of the coupler is where two circles about the crank's tip and the rocker's
foot put it, within 1e-9 m over three turns, and the loop is closed to 1e-12 m.  (2) While the crank
goes through the half turn away from the rocker, the tip stays on a line of 0.4 m within 1 mm.
(3) The effort of the drive is the rate of the energy of three rods, written below in the crank's
angle, over its speed, and its work over a whole turn is zero.  (4) Of the five rows of the pin that
closes the loop two say anything, and one motion is left, which the drive takes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import simpson

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
CRANK, ROD, FEET, SPEED = 0.1, 0.25, 0.2, 6.0
MASS = {"crank": 0.4, "coupler": 1.5, "rocker": 0.8}
INERTIA = {"crank": 3.4e-4, "coupler": 0.03125, "rocker": 4.2e-3}
TURN = 2 * np.pi / SPEED
Array = NDArray[np.float64]
Places = NDArray[np.complex128]


def linkage(angle: Array) -> tuple[Places, Places]:
    """Tip of the crank and the joint: rods of equal length stand over the middle of their feet."""
    knee = CRANK * np.exp(1j * angle)
    half = (FEET - knee) / 2
    return knee, knee + half + 1j * half / abs(half) * np.sqrt(ROD**2 - abs(half) ** 2)


def energy(t: Array) -> Array:
    """Of the three rods, J; speeds by central differences of places and angles."""

    def rate(of: Places) -> Places:
        return of / (2 * h)

    h = 1e-6
    knee, joint = linkage(SPEED * t)
    (knee0, joint0), (knee1, joint1) = (linkage(SPEED * (t + s)) for s in (-h, h))
    total = np.zeros_like(t)
    for name, foot, foot0, foot1, tip, tip0, tip1, part in (
        ("crank", 0 * knee, 0 * knee, 0 * knee, knee, knee0, knee1, 0.5),
        ("coupler", knee, knee0, knee1, joint, joint0, joint1, 1.0),
        ("rocker", FEET + 0 * knee, FEET + 0 * knee, FEET + 0 * knee, joint, joint0, joint1, 0.5),
    ):
        center = foot + part * (tip - foot)
        moved = foot1 - foot0 + part * (tip1 - tip0 - foot1 + foot0)
        turned = np.angle((tip1 - foot1) / (tip0 - foot0))
        total += MASS[name] * (abs(rate(moved)) ** 2 / 2 + 9.81 * center.imag)
        total += INERTIA[name] * (turned / (2 * h)) ** 2 / 2
    return total


def main() -> None:
    """All four statements."""
    model = mstmm.compile(mstmm.load_scene(SCENE))
    loops = model.loops
    print(
        f"cut: {loops.cut_hinges[0]}; {loops.rank} of {len(loops.constraint_rows)} rows independent"
    )
    assert (loops.rank, len(loops.constraint_rows), loops.mobility) == (2, 5, 0)

    times = np.linspace(0.0, 3 * TURN, 601)
    result = model.simulate(3 * TURN, rtol=1e-10, output_times=times)
    assert result.success, result.message
    knee, joint = linkage(SPEED * times)
    tip = result.position("coupler.tip")
    apart = abs(tip[:, 0] + 1j * tip[:, 1] - (2 * joint - knee)).max()
    gap = np.abs(result.position("coupler.joint") - result.position("rocker.tip")).max()
    print(f"tip off its curve by {apart:.1e} m, loop open by {gap:.1e} m")
    assert apart < 1e-9
    assert gap < 1e-12

    far = np.cos(SPEED * times) < 0
    line = tip[far]
    print(f"straight: {np.ptp(line[:, 0]):.4f} m long, {np.ptp(line[:, 1]):.2e} m high")
    assert np.ptp(line[:, 0]) > 0.39
    assert np.ptp(line[:, 1]) < 1e-3

    effort = result.quantity("crank_pin.effort").values
    step = 1e-4
    wanted = (energy(times + step) - energy(times - step)) / (2 * step * SPEED)
    error = np.abs(effort - wanted).max() / np.abs(wanted).max()
    work = simpson(SPEED * effort[:201], x=times[:201])
    print(
        f"effort up to {abs(wanted).max():.3f} N m, off by {error:.1e}; work of a turn {work:.1e} J"
    )
    assert error < 1e-5
    assert abs(work) < 1e-4


if __name__ == "__main__":
    main()
