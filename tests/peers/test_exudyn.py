"""Spatial loops against Exudyn, which holds bodies together by constraints alone, those too that
repeat others.

Generalized alpha errs by h^2: a run with half the step tells its error, and without this error it
is where ours is, by what is left of order h^3 and of its Newton iterations.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.jets import Array
from tests.support.peers.exudyn_peer import ExudynPeer
from tests.support.scenes.linkages import OBLIQUE, bricard, four_bar
from tests.system.loops.test_slider_crank import slider_crank

BALL = {"type": "ball", "initial": {"q": [1, 0, 0, 0]}}
SCENES = {
    "four-bar": four_bar(tilt=OBLIQUE, knee=BALL, tip=BALL),
    "slider-crank": slider_crank().model_dump(mode="json", exclude_unset=True),
    "pins alone": four_bar(tilt=OBLIQUE),
    "Bricard's ring": bricard(),
}
T_END, STEPS = 0.2, 200
#: What its iterations leave over, in m and m/s.
NEWTON = 1e-9


def closed_state(model: mstmm.Model, rng: np.random.Generator) -> tuple[Array, Array]:
    """An assembled state near the start, with a turning crank."""
    q, _ = model.initial_state()
    crank = np.zeros(model.nu)
    crank[0] = rng.uniform(1.0, 6.0)
    return model.assemble(q + rng.uniform(-0.1, 0.1, model.nq), crank, hold=[])


def ends(scene: dict[str, Any], q: Array, u: Array, steps: int) -> Array:
    """Places and velocities of the bodies after T_END, (2, bodies, 3)."""
    peer = ExudynPeer(scene, q, u)
    peer.run(T_END, steps)
    return np.array([peer.motions("Position"), peer.motions("Velocity")])


@pytest.mark.parametrize("draw", range(3))
@pytest.mark.parametrize("what", SCENES)
def test_exudyn_errs_by_its_own_error(what: str, draw: int) -> None:
    scene = SCENES[what]
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    q, u = closed_state(model, np.random.default_rng(draw))
    run = model.simulate(T_END, rtol=1e-11, atol=1e-13, initial=(q, u), output_times=[0, T_END])
    assert run.success, run.message
    names = [body["name"] for body in scene["body"]]
    ours = np.array([[f(name)[-1] for name in names] for f in (run.position, run.velocity)])
    whole, half = (ends(scene, q, u, steps) for steps in (STEPS, 2 * STEPS))
    for found, coarse, fine in zip(ours, whole, half, strict=True):
        error = np.abs(coarse - fine).max() / 3
        assert error < 1e-3
        assert np.abs(found - fine).max() < 1.01 * error + NEWTON
        assert np.abs(found - (4 * fine - coarse) / 3).max() < 1e-2 * error + NEWTON
