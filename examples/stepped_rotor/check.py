"""Whirl speeds of a stepped rotor against the published ones and a finite-element program.

python examples/stepped_rotor/check.py
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvals

import mstmm

Data: Any = import_module("make_scene")  # beside this file
SCENE = Path(__file__).with_name("scene.toml")
RPM = 2 * np.pi / 60
Array = NDArray[np.float64]

#: Nelson and McVaugh (1976): whirl speeds in rpm where the spin is this part of them.
PUBLISHED = {1.0: (15470, 17159, 46612, 49983, 64752), 0.5: (15858, 16700, 47520, 49204, 69640)}
#: Their orthotropic bearings, N/m.
ORTHOTROPIC = np.array([[3.503e7, -8.756e6], [-8.756e6, 3.503e7]])


def whole(spin: float, bearing: Array) -> Array:
    """Whirl speeds (rad/s), rising, of elements with cubic shapes, as the paper has them: v, v' of
    all stations, then w, w'."""
    n: int = 2 * len(Data.STATIONS)
    mass: Array = np.zeros((n, n))
    rotary, stiffness = mass.copy(), mass.copy()
    rows = zip(Data.LENGTHS, Data.AREAS, Data.SECOND_MOMENTS, strict=True)
    for k, (a, area, moment) in enumerate(rows):
        at = np.s_[2 * k : 2 * k + 4, 2 * k : 2 * k + 4]
        unit = np.diag([1, a, 1, a])
        bent = [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]
        turned = [[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]]
        moved = [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
        stiffness[at] += Data.YOUNG * moment / a**3 * unit @ bent @ unit
        rotary[at] += Data.DENSITY * moment / (30 * a) * unit @ turned @ unit
        mass[at] += Data.DENSITY * area * a / 420 * unit @ moved @ unit
    gyroscopic = 2 * rotary
    place = 2 * Data.DISC_STATION
    mass[place, place] += Data.MASS
    rotary[place + 1, place + 1] += Data.ACROSS
    gyroscopic[place + 1, place + 1] += Data.POLAR
    m, held = np.kron(np.eye(2), mass + rotary), np.kron(np.eye(2), stiffness)
    for station in Data.BEARINGS:
        both = [2 * station, n + 2 * station]
        held[np.ix_(both, both)] += bearing
    g = spin * np.kron([[0, 1], [-1, 0]], gyroscopic)
    zero, one = np.zeros_like(m), np.eye(2 * n)
    values = eigvals(np.block([[zero, one], [-held, -g]]), np.block([[one, zero], [zero, m]]))
    return np.sort(values.imag[values.imag > 0])


def near(found: Array, known: float) -> float:
    """The frequency next to one that is expected."""
    return float(found[np.abs(found - known).argmin()])


def check_published(model: mstmm.Model) -> None:
    """Whirl speeds of the paper, isotropic bearings."""
    worst = 0.0
    for part, speeds in PUBLISHED.items():
        for known in speeds:
            locus = model.root_locus("constants.spin", [part * known * RPM])
            assert locus.frame == "fixed"
            worst = max(worst, abs(near(locus.frequency[0] * 60, known) / known - 1))
    print(f"isotropic bearings: whirl speeds as published to {worst:.1e}")
    assert worst < 4e-3


def check_elements(model: mstmm.Model, name: str, bearing: Array) -> None:
    """Whirl speeds of the finite elements."""
    worst, spins = 0.0, RPM * np.array([20000.0, 60000.0])
    for spin in spins:
        locus = model.root_locus("constants.spin", [spin])
        known, found = whole(spin, bearing), np.sort(2 * np.pi * locus.frequency[0])
        worst = max(worst, float(np.abs(found[:10] / known[:10] - 1).max()))
    print(f"{name} bearings: ten whirl speeds as of finite elements to {worst:.1e}")
    assert worst < 2e-4


def main() -> None:
    """All statements."""
    model = mstmm.compile(mstmm.load_scene(SCENE), engine="looped")
    check_published(model)
    check_elements(model, "isotropic", Data.STIFFNESS * np.eye(2))
    upper = {f"bearing{k}.stiffness[{place}]": entry for k in (1, 2)
             for place, entry in ((6, 3.503e7), (7, -8.756e6), (11, 3.503e7))}  # fmt: skip
    check_elements(model.with_parameters(upper), "orthotropic", ORTHOTROPIC)


if __name__ == "__main__":
    main()
