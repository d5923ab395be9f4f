"""A scissor mast goes up: two units, forty, a thousand.

Statements: (1) of the five rows of each crossing two say anything, and the drive leaves no motion.
(2) All the way up the tips of the mast stand where the angle of its rods puts them, to 1e-9 of its
height.  (3) The drive pushes with the rate of the energy of all rods, written below in the width of
the mast, over the rate of that width.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
ROD, MASS, SHOE, TIME = 0.5, 0.2, 0.3, 2.0
START, STOP = np.radians([15.0, 60.0])
Array = NDArray[np.float64]


def mast(units: int) -> mstmm.Scene:
    """The scene with its second unit repeated up to so many."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    for table in ("body", "hinge"):
        second = [one for one in data[table] if one["name"].endswith("1")]
        data[table] += [moved_on(one, k) for k in range(2, units) for one in second]
    return mstmm.Scene(**data)


def moved_on(one: dict[str, Any], unit: int) -> dict[str, Any]:
    """A part of the second unit as that of another."""
    numbers = {"0": str(unit - 1), "1": str(unit)}
    names = {
        key: re.sub(r"^([a-z]+)([01])", lambda found: found[1] + numbers[found[2]], one[key])
        for key in ("name", "inboard", "outboard") if key in one
    }  # fmt: skip
    return one | names


def width(t: Array) -> Array:
    """Of the mast, m: where its slide is."""
    ease = t / TIME - np.sin(2 * np.pi * t / TIME) / (2 * np.pi)
    return ROD * (np.cos(START) + (np.cos(STOP) - np.cos(START)) * ease)


def energy(t: Array, units: int) -> Array:
    """Of shoe and rods, J; rates by central differences."""
    h = 1e-6
    low, high = width(t - h), width(t + h)
    rate = (high - low) / (2 * h)
    rises = (np.sqrt(ROD**2 - high**2) - np.sqrt(ROD**2 - low**2)) / (2 * h)
    turns = (np.arccos(high / ROD) - np.arccos(low / ROD)) / (2 * h)
    middles = np.arange(units) + 0.5  # heights of the crossings, in parts of a unit's
    moving = (rate / 2) ** 2 * units + rises**2 * (middles**2).sum()
    turning = ROD**2 / 12 * turns**2 * units
    height = np.sqrt(ROD**2 - width(t) ** 2) * middles.sum()
    return MASS * (moving + turning + 2 * 9.81 * height) + SHOE * rate**2 / 2


def raised(units: int, samples: int) -> None:
    """Statements 1 to 3 for a mast of so many units."""
    model = mstmm.compile(mast(units), engine="looped")
    loops = model.loops
    assert (len(loops.cut_hinges), len(loops.constraint_rows)) == (units, 5 * units)
    assert (loops.rank, loops.mobility, loops.singular) == (2 * units, 0, False)

    times = np.linspace(0.0, TIME, samples)
    result = model.simulate(TIME, rtol=1e-6, output_times=times)
    assert result.success, result.message
    x = width(times)
    height = units * np.sqrt(ROD**2 - x**2)
    tips = [result.position(f"{name}{units - 1}.tip") for name in "ab"]
    wanted = [np.stack([place, height, 0 * x], axis=-1) for place in (x, 0 * x)]
    apart = max(float(np.abs(a - b).max()) for a, b in zip(tips, wanted, strict=True))

    step = 1e-4
    power = (energy(times + step, units) - energy(times - step, units)) / (2 * step)
    rate = (width(times + step) - width(times - step)) / (2 * step)
    moving = np.abs(rate) > 1e-2
    pushed = result.quantity("slide.effort").values[moving]
    force = power[moving] / rate[moving]
    error = float(np.abs(pushed - force).max() / np.abs(force).max())
    print(
        f"{units} units: from {height[0]:.2f} m to {height[-1]:.2f} m, tips off by {apart:.1e} m; "
        f"drawn with up to {np.abs(force).max():.4g} N, off by {error:.1e}"
    )
    assert apart < 1e-9 * height[-1]
    assert error < 1e-5


def main() -> None:
    """The mast of the scene, one of forty units, one of a thousand."""
    for units, samples in ((2, 41), (40, 41), (1000, 3)):
        raised(units, samples)


if __name__ == "__main__":
    main()
