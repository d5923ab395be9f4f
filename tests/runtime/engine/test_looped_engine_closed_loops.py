"""Random mechanisms with closed loops against the dense Newton-Euler equations.

A pivot of L is the share of its row that the rows before it have not said yet, and rounding grows
by its inverse: the nearer rows are to repeating others, the more digits doubles lose.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.pipeline.extended_precision import extended_precision_accelerations, relative_error
from mstmm.runtime.engine.looped_engine import LoopedEngine
from mstmm.runtime.engine.loops.loop_calls import LoopCalls
from tests.reference import newton_euler as dense
from tests.reference.compare import worst
from tests.reference.random_loops import random_mechanism
from tests.support.draws import draws

#: Over the smallest pivot; and what all of these keep, down to pivots of 7e-6.
ROUNDING, MOST = 1e-14, 5e-12


def smallest_pivot(model: mstmm.Model, q: Any) -> float:
    """In parts of the mobility of its row; 1 where nothing closes."""
    if not model.loops.cut_hinges:
        return 1.0
    calls = LoopCalls(LoopedEngine(model.packed_scene), q)
    calls.correction(calls.velocity_level, q, np.zeros(model.nu))
    return float((calls.pivots() / calls.mobility).min())


@pytest.mark.parametrize("seed", draws(15, 40))
def test_random_mechanisms(seed: int) -> None:
    """Accelerations, loads and efforts of all hinges, whichever of them are cut."""
    check_mechanism(seed)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(40, 400))
def test_more_random_mechanisms(seed: int) -> None:
    check_mechanism(seed)


def check_mechanism(seed: int) -> None:
    scene, q, u = random_mechanism(seed)
    found = dense.solve(scene, q, u)
    model = mstmm.compile(mstmm.Scene(**copy.deepcopy(scene)))
    allowed = min(ROUNDING / smallest_pivot(model, q), MOST)
    assert worst(model.accelerations(q, u), found.udot) < allowed
    assert not model.loops.redundant_rows
    result = model.simulate(t_end=0.0, initial=(q, u))
    assert result.success, result.message
    names = [hinge["name"] for hinge in scene["hinge"]]
    loads = [np.concatenate([result.force(n)[0], result.moment(n)[0]]) for n in names]
    inertia = max(body["mass"] for body in scene["body"]) * np.abs(found.udot).max(initial=0.0)
    wanted = np.hstack([found.force, found.moment])
    assert worst(loads, wanted, floor=max(1.0, inertia)) < allowed


def test_what_is_lost_is_rounding_of_the_sweep() -> None:
    """With 60 digits the sweep is where the dense equations are, which keep 14; in doubles the
    mechanism that loses most keeps 11, by a pivot of 1.2e-5."""
    scene, q, u = random_mechanism(2)
    model = mstmm.compile(mstmm.Scene(**copy.deepcopy(scene)), engine="looped")
    exact = extended_precision_accelerations(model)(q, u)
    assert relative_error(dense.solve(scene, q, u).udot, exact) < 3e-14
    pivot = smallest_pivot(model, q)
    assert 1e-6 < pivot < 1e-4
    lost = relative_error(model.accelerations(q, u), exact)
    assert lost < np.finfo(float).eps / pivot
