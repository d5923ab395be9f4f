"""What cannot follow closed loops yet says so, and names the loop; what can does its work."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm

from .linkages import cranks
from .test_four_bar import linkage

LOOP = 'loop "closing_pin - '


@pytest.fixture(scope="module")
def model() -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**linkage("closing_pin", laws=False)))


ASKED: dict[str, Callable[[mstmm.Model], Any]] = {
    "advise": lambda m: mstmm.advise(m, 0.1),
    "chart": lambda m: mstmm.chart(m, 0.1),
    **{
        method: lambda m, method=method: m.simulate(0.1, method)  # type: ignore[misc]
        for method in ("exprb32", "scipy-DOP853", "sundials-BDF")
    },
    **{
        method: lambda m, method=method: m.simulate(0.1, method, step=1e-3)  # type: ignore[misc]
        for method in ("dttmm", "dttmm-classical")
    },
    "laws alone": lambda m: m.simulate(0.1, "esdirk436", tangent="laws"),
    "least squares": lambda m: mstmm.compile(m.scene, sweep="qr"),
}


@pytest.mark.parametrize("asked", ASKED)
def test_refused(asked: str, model: mstmm.Model) -> None:
    with pytest.raises(mstmm.SceneError) as caught:
        ASKED[asked](model)
    assert LOOP in str(caught.value) and "; " in str(caught.value)


def test_a_structure() -> None:
    """The third crank stands off the line of the other two: the coupler cannot follow all."""
    scene = cranks()
    scene["hinge"][2]["position"] = [1.5, 0.2, 0.0]
    with pytest.raises(mstmm.SceneError, match=r'no freedom is left .* at "top.*a structure; take'):
        mstmm.compile(mstmm.Scene(**scene))


def test_no_fused_code() -> None:
    scene = linkage("closing_pin", laws=False)
    held = scene["hinge"][3]
    start = held.pop("initial")["q"]
    scene["hinge"][0]["initial"].pop("u")
    held |= {"drive": f"{start!r}", "release": "t >= 0.2"}
    model = mstmm.compile(mstmm.Scene(**scene))
    assert model.engine_choice.startswith('looped: hinge "closing_pin" is released')
    with pytest.raises(mstmm.SceneError, match='no fused code: hinge "closing_pin" is released'):
        mstmm.compile(model.scene, engine="fused")


def test_a_loop_that_a_constraint_closes() -> None:
    scene = linkage(None, laws=False)
    del scene["hinge"][3]
    rod = {"type": "distance", "from": "coupler.tip", "to": "rocker.tip", "length": 0.3}
    model = mstmm.compile(mstmm.Scene(**scene, constraint=[rod | {"name": "rod"}]))
    for method in ("exprb32", "dttmm"):
        with pytest.raises(mstmm.SceneError, match='loop of constraint "rod" is closed'):
            model.simulate(0.1, method, step=1e-3)


@pytest.mark.parametrize("method", ["dopri5", "dop853", "pirk13", "auto", "rodas5p", "kvaerno5"])
def test_methods_that_close_loops(method: str, model: mstmm.Model) -> None:
    result = model.simulate(0.5, method, rtol=1e-8)
    assert result.success, result.message
    reference = model.simulate(0.5, "dop853", rtol=1e-11)
    assert np.abs(result.q[-1] - reference.q[-1]).max() < 1e-6


def test_batches(model: mstmm.Model) -> None:
    q, u = model.initial_state()
    batch = model.simulate_batch((np.array([q, q]), np.array([u, 2 * u])), t_end=0.3)
    assert batch.success.all()
    alone = model.simulate(0.3, initial=(q, 2 * u), output_times=[0.0, 0.3])
    assert np.abs(batch.q[1, -1] - alone.q[-1]).max() < 1e-12
