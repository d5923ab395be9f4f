"""The order of every implicit method on scenes: rigid and flexible, planar and spatial, driven."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.steppers import IMPLICIT, get
from mstmm.runtime.model.model import Model
from tests.support.implicit_methods import motions

#: Scene, time (s), and how much of the order the steps below may miss.
CASES: dict[str, tuple[motions.Scene, float, float]] = {
    "planar": (motions.double_pendulum(), 0.5, 0.2),
    "spatial": (motions.spatial_rods(), 0.5, 0.2),
    "flexible": (motions.beam_pendulum(5.0), 0.05, 0.2),
    "driven": (motions.driven_root(1e3, 0.1), 0.5, 0.65),  # stiff: it shows itself late
}


@cache
def exact(name: str) -> tuple[Model, Any]:
    scene, t_end, _ = CASES[name]
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    run = model.simulate(t_end, rtol=1e-13, atol=1e-14, output_times=[t_end])
    assert run.success, run.message
    return model, run.q


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("method", IMPLICIT)
def test_errors_fall_with_the_order(method: str, name: str) -> None:
    (model, q), (_, t_end, missing) = exact(name), CASES[name]
    order, errors = get(method).order, []
    few = 16 if order > 3 else 32
    for count in (few, 4 * few):  # tolerances by which Newton's iteration leaves nothing
        run = model.simulate(
            t_end, method, t_end / count, rtol=1e-12, atol=1e-13, output_times=[t_end]
        )
        assert run.success, run.message
        errors.append(float(np.abs(run.q - q).max()))
    assert np.log2(errors[0] / errors[1]) / 2 > order - missing, errors
