"""A hanging rope of many rods swings as Bernoulli's rope does.

Statement: released from a J0(j sqrt(s/L)) the tip moves as a cos(w t), w = (j/2) sqrt(g/L); the
deviation falls with the square of the number of rods.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.special import j0, jn_zeros

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
GRAVITY, LENGTH, AMPLITUDE = 9.81, 2.0, 1e-5


def deviation(scene: mstmm.Scene) -> float:
    """Largest distance of the tip from a cos(w t) over a period, in parts of a."""
    rods = scene.chain[0].count
    first = float(jn_zeros(0, 1)[0])
    omega = 0.5 * first * np.sqrt(GRAVITY / LENGTH)
    below = 1 - np.linspace(0, 1, rods + 1)  # of every joint, the part of the rope below it
    slope = np.diff(AMPLITUDE * j0(first * np.sqrt(below))) / (LENGTH / rods)
    q = np.diff(np.arcsin(slope), prepend=0.0)
    times = np.linspace(0, 2 * np.pi / omega, 41)
    result = mstmm.compile(scene).simulate(
        t_end=times[-1], rtol=1e-7, atol=1e-12, output_times=times, initial=(q, 0 * q)
    )
    assert result.success, result.message
    tip = result.position("rope[last].tip")[:, 1]
    return float(abs(tip - AMPLITUDE * np.cos(omega * times)).max() / AMPLITUDE)


def refined(scene: mstmm.Scene) -> mstmm.Scene:
    """The same rope of twice as many rods of half the length."""
    data = scene.model_dump(by_alias=True)
    rope, body = data["chain"][0], data["chain"][0]["body"][0]
    rope["count"] *= 2
    body["mass"] /= 2
    body["center_of_mass"] = [x / 2 for x in body["center_of_mass"]]
    body["inertia"] = [x / 8 for x in body["inertia"]]
    body["ends"]["tip"]["position"] = [x / 2 for x in body["ends"]["tip"]["position"]]
    return mstmm.Scene(**data)


def main() -> None:
    """Swing once with 100 rods and once with 200."""
    scene = mstmm.load_scene(SCENE)
    coarse, fine = deviation(scene), deviation(refined(scene))
    print(f"deviation from Bernoulli's rope: {coarse:.2e} with 100 rods, {fine:.2e} with 200")
    assert coarse < 1e-4
    assert fine < 0.3 * coarse


if __name__ == "__main__":
    main()
