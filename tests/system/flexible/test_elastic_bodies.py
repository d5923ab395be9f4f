"""Elastic bodies in the engine: against beams, between frames, and their energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from tests.support.scenes import elastic_bar as bar

Array = NDArray[np.float64]

#: The bar without Poisson's effect, and without the shapes that only shorten explicit steps.
SOLID: dict[str, Any] = {"poisson": 0.0, "highest_frequency": 4000.0}
#: The beam that the bar is: rigidities about y and z, both rotary inertias in.
BEAM = {
    "name": "bar", "length": bar.LENGTH, "mass_per_length": bar.MASS / bar.LENGTH,
    "bending_stiffness": [bar.EI_Z, bar.EI_Y], "torsional_stiffness": 4000.0,
    "rotary_inertia": [bar.MASS * bar.HEIGHT**2 / 12, bar.MASS * bar.WIDTH**2 / 12],
    "polar_inertia_per_length": bar.MASS * (bar.HEIGHT**2 + bar.WIDTH**2) / 12,
    "modes": {"y": 2, "z": 2},
}  # fmt: skip


def simulate_bar(
    flexible: dict[str, Any], hinge: dict[str, Any], t_end: float, rows: int = 41
) -> Any:
    """The bar on a hinge at its root under gravity along -z."""
    kind = "beam" if "length" in flexible else "elastic"
    holding = {"name": "held", "inboard": "ground", "outboard": "bar.root"} | hinge
    tables: dict[str, Any] = {kind: [flexible], "hinge": [holding]}
    model = mstmm.compile(mstmm.Scene(gravity=[0, 0, -9.81], **tables), "looped")
    return model.simulate(t_end, output_times=np.linspace(0, t_end, rows), rtol=1e-8, atol=1e-11)


SPIN_UP = {"type": "pin", "axis": [0, 0, 1], "drive": "20*(t - 0.25/(2*pi)*sin(8*pi*t))"}


def test_spun_up_like_a_beam() -> None:
    """Driven to 20 rad/s in 0.25 s under gravity: deflections in both planes, stiffened by spin."""
    solid, beam = simulate_bar(bar.table(**SOLID), SPIN_UP, 0.4), simulate_bar(BEAM, SPIN_UP, 0.4)
    drawn = [result.deflection("bar", "tip") if result is beam else _deflection(result)
             for result in (solid, beam)]  # fmt: skip
    for direction in (1, 2):
        scale = np.abs(drawn[1][:, direction]).max()
        assert scale > 1e-4
        assert np.abs(drawn[0] - drawn[1])[:, direction].max() < 0.02 * scale


def _deflection(result: Any) -> Array:
    """Of the tip against the turning root, its axes; (n, 3)."""
    angle = result.q[:, 0]
    x, y = np.cos(angle), np.sin(angle)
    tip = result.position("bar.tip")
    inward = np.stack([x * tip[:, 0] + y * tip[:, 1], x * tip[:, 1] - y * tip[:, 0], tip[:, 2]], 1)
    return np.asarray(inward - [bar.LENGTH, 0, 0])


@pytest.mark.parametrize("hinge", [{"type": "pin", "axis": [0, 1, 0]}, {"type": "ball"}])
def test_energy_of_a_swinging_bar(hinge: dict[str, Any]) -> None:
    """A pendulum of finite elements in its mean frame keeps its energy, in space too."""
    start = {"q": [0.2]} if hinge["type"] == "pin" else {"u": [3.0, 1.0, 2.0]}
    result = simulate_bar(bar.table(**SOLID), hinge | {"initial": start}, 0.4)
    assert result.model.flexible_bodies["bar"].frame == "mean"
    exchanged = np.abs(
        result.energy_components()["gravity"] - result.energy_components()["gravity"][0]
    ).max()
    assert np.abs(result.energy() - result.energy()[0]).max() < 1e-7 * exchanged
    assert np.abs(result.position("bar.root")).max() < 1e-12


def test_frames_give_the_same_motion() -> None:
    """A bar held at its root and shaken: tangent and mean frame, and the end pose of each."""
    shaken = {"type": "prismatic", "axis": [0, 0, 1], "drive": "1e-3*(1 - cos(60*t))"}
    one, other = (
        simulate_bar(bar.table(**SOLID, frame=frame), shaken, 0.2).position("bar.tip")
        for frame in ("tangent", "mean")
    )
    moves = np.abs(one - one[0]).max()
    assert moves > 1e-3
    assert np.abs(one - other).max() < 2e-3 * moves


def test_fused_and_looped_agree() -> None:
    scene = mstmm.Scene(
        gravity=[0, 0, -9.81], elastic=[bar.table(modes=1, highest_frequency=2000.0)],
        body=[{"name": "bob", "mass": 0.3, "inertia": [1e-3] * 3}],
        hinge=[
            {"name": "held", "type": "pin", "inboard": "ground", "outboard": "bar.root"},
            {"name": "far", "type": "ball", "inboard": "bar.tip", "outboard": "bob"},
        ],
    )  # fmt: skip
    draw = np.random.default_rng(3)
    looped, fused = (mstmm.compile(scene, engine) for engine in ("looped", "fused"))
    q, u = looped.initial_state()
    q[5:] = 1e-3 * draw.normal(size=len(q) - 5)
    u[:] = draw.normal(size=len(u))
    one, other = looped.accelerations(q, u), fused.accelerations(q, u)
    assert np.abs(one - other).max() < 1e-11 * np.abs(one).max()
