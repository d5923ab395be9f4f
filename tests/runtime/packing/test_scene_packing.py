"""What cannot follow closed loops yet says so, and names the loop; what can does its work."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.scenes.linkages import COUPLER, CRANK, ROCKER, cranks, four_bar
from tests.support.scenes.published_mechanisms import four_bars
from tests.system.loops.test_four_bar import GROUND, linkage

LOOP = 'loop "closing_pin - '


@pytest.fixture(scope="module")
def model() -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**linkage("closing_pin", laws=False)))


ASKED: dict[str, Callable[[mstmm.Model], Any]] = {
    "exprb32": lambda m: m.simulate(0.1, "exprb32"),
    **{
        method: lambda m, method=method: m.simulate(0.1, method, step=1e-3)  # type: ignore[misc]
        for method in ("dttmm", "dttmm-classical")
    },
    "laws alone": lambda m: m.simulate(0.1, mstmm.methods.Implicit("esdirk436", tangent="laws")),
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
    with pytest.raises(
        mstmm.SceneError, match=r'no degrees of freedom .a structure.* at "top.*; use'
    ):
        mstmm.compile(mstmm.Scene(**scene))


@pytest.mark.parametrize("start", [(0.0, 0.0, np.pi), (0.1, 0.0, 3.1)])
def test_a_linkage_that_is_stretched_out(start: tuple[float, ...]) -> None:
    """The feet are as far apart as the rods together reach: whatever moves opens the loop."""
    scene = four_bar()
    scene["hinge"][3]["position"] = [CRANK + COUPLER + ROCKER, 0, 0]
    for number, angle in zip((0, 1, 3), start, strict=True):
        scene["hinge"][number]["initial"] = {"q": angle}
    with pytest.raises(mstmm.SceneError, match=r'at "tip" in an isolated .*; change a length'):
        mstmm.compile(mstmm.Scene(**scene))


def test_cranks_in_line_can_be_left() -> None:
    """A parallelogram that lies flat, in which two motions begin."""
    loops = mstmm.compile(mstmm.Scene(**four_bars(1, angle=0.0))).loops
    assert loops.singular and loops.mobility == 2


@pytest.mark.parametrize(
    "led", [{"expression": "foot.q", "equals": "0.9 + t"}, {"speeds": "foot.u", "equals": 1}]
)
def test_a_coupling_leads_a_mechanism_as_a_drive_does(led: dict[str, Any]) -> None:
    coupling = {"name": "lead", **led}
    coupled = mstmm.compile(mstmm.Scene(**four_bar(), coupling=[coupling]), engine="looped")
    scene = four_bar()
    scene["hinge"][0] |= {"drive": "0.9 + t"}
    del scene["hinge"][0]["initial"]
    driven = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    assert coupled.loops.mobility == driven.loops.mobility == 0
    ends = [one.simulate(0.5, rtol=1e-9).q[-1] for one in (coupled, driven)]
    assert np.abs(ends[0] - ends[1]).max() < 1e-7
    with pytest.raises(mstmm.SceneError, match=r'a structure.* at "tip", "lead"'):
        mstmm.compile(mstmm.Scene(**four_bar(), coupling=[coupling | {"equals": 0.0}]))


def test_a_value_beyond_all_squares() -> None:
    coupling = {"name": "far", "expression": "foot.q", "equals": 1e300}
    with warnings.catch_warnings(), pytest.raises(mstmm.SceneError, match=r"a gap of 1e\+300"):
        warnings.simplefilter("error")
        mstmm.compile(mstmm.Scene(**four_bar(), coupling=[coupling]))


def test_no_fused_code() -> None:
    scene = linkage("closing_pin", laws=False)
    held = scene["hinge"][3]
    start = held.pop("initial")["q"]
    scene["hinge"][0]["initial"].pop("u")
    held |= {"drive": f"{start!r}", "release": "t >= 0.2"}
    model = mstmm.compile(mstmm.Scene(**scene))
    assert model.engine_reason.startswith('looped: hinge "closing_pin" is released')
    with pytest.raises(mstmm.SceneError, match='no fused code: hinge "closing_pin" is released'):
        mstmm.compile(model.scene, engine="fused")


def test_a_loop_that_a_constraint_closes() -> None:
    scene = linkage(None, laws=False)
    del scene["hinge"][3]
    rod = {"type": "distance", "from": "coupler.tip", "to": "rocker.tip", "length": 0.3}
    model = mstmm.compile(mstmm.Scene(**scene, constraint=[rod | {"name": "rod"}]))
    for method in ("exprb32", "dttmm"):
        with pytest.raises(
            mstmm.SceneError, match='does not support closed loops, found loop of constraint "rod"'
        ):
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


def test_a_row_of_a_batch_whose_loops_stay_open(model: mstmm.Model) -> None:
    """It fails alone, and one start serves all rows."""
    feet = [GROUND, 9.0, GROUND + 0.05]
    batch = model.simulate_batch(model.initial_state(), {"rocker_pin.position[0]": feet}, t_end=0.1)
    assert batch.success.tolist() == [True, False, True] and batch.q.shape == (3, 1, model.nq)
    assert 'the loop at hinge "closing_pin" cannot be closed' in batch.messages[1]
    assert np.isnan(batch.q[1]).all()
    alone = model.with_parameters({"rocker_pin.position[0]": feet[2]})
    q = alone.simulate(0.1, initial=model.initial_state(), output_times=[0.1]).q
    assert np.abs(batch.q[2] - q).max() < 1e-12


def test_a_mass_centre_out_of_all_proportion_is_named() -> None:
    """Its body hardly moves, so that the loop stays open for no fault of lengths or axes."""
    scene = linkage("closing_pin", laws=False)
    scene["body"] = [
        body | ({"center_of_mass": [-1e12, 0, 0]} if body["name"] == "rocker" else {})
        for body in scene["body"]
    ]
    scene["hinge"] = [
        hinge | ({"initial": {"q": 0.3}} if hinge["name"] == "rocker_pin" else {})
        for hinge in scene["hinge"]
    ]
    with pytest.raises(mstmm.SceneError, match=r'mass centre of body "rocker" is 1e\+12 m'):
        mstmm.compile(mstmm.Scene(**scene))
