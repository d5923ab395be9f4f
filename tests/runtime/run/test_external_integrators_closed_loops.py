"""Integrators of others on closed loops: a second opinion on runs of mechanisms too."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import mstmm
from mstmm.runtime.run.external_integrators import METHODS
from tests.support.models import looped_model
from tests.support.scenes.constraints import on_a_road
from tests.support.scenes.gears import planetary
from tests.support.scenes.linkages import bricard
from tests.system.loops.test_flexible_against_tree import slider_crank as bent_slider_crank
from tests.system.loops.test_four_bar import linkage
from tests.system.loops.test_slider_crank import slider_crank

#: Scene and how long it runs, s: laws, repeated rows, shapes, rows of speeds, a coupling.
MODELS: dict[str, tuple[Callable[[], mstmm.Model], float]] = {
    "four-bar": (lambda: looped_model(linkage("closing_pin")), 0.5),
    "Bricard": (lambda: looped_model(bricard()), 0.2),
    "a rod that bends": (lambda: looped_model(bent_slider_crank()), 0.01),
    "a disc that rolls": (lambda: looped_model(on_a_road()), 0.2),
    "gears": (lambda: planetary({"sun": 2.0}), 0.2),
}
RTOL = 1e-7


#: One of each kind of them: what is told where it goes on from, and what is not.
KINDS = ("scipy-RK45", "scipy-BDF", "sundials-BDF")


@pytest.mark.parametrize(
    ("what", "method"),
    [("four-bar", method) for method in METHODS]
    + [(what, method) for what in list(MODELS)[1:] for method in KINDS],
)
def test_all_of_them_close_loops(what: str, method: str) -> None:
    make, t_end = MODELS[what]
    model, times = make(), np.linspace(0.0, t_end, 4)
    wanted = model.simulate(t_end, rtol=1e-11, atol=1e-13, output_times=times)
    run = model.simulate(t_end, method, rtol=RTOL, atol=1e-2 * RTOL, output_times=times)
    assert run.success, run.message
    assert np.abs(run.q - wanted.q).max() < 300 * RTOL
    assert run.certificate.loop_closure is not None
    assert run.certificate.loop_closure.gap < 1e-12 and run.certificate.loop_closure.slip < 1e-12


@pytest.mark.parametrize("method", ["scipy-LSODA", "sundials-Adams"])
def test_what_keeps_its_history_begins_anew(method: str) -> None:
    """Left alone both drift apart until their steps stick."""
    model, times = mstmm.compile(slider_crank(), engine="looped"), [0.0, 7.5]
    wanted = model.simulate(times[-1], rtol=1e-10, output_times=times)
    run = model.simulate(times[-1], method, rtol=1e-6, output_times=times)
    assert run.success, run.message
    assert abs(run.coordinates("shaft")[-1] - wanted.coordinates("shaft")[-1]) < 0.05


def test_the_same_method_errs_alike() -> None:
    """DOP853 of SciPy and that in C, both with the rates of a step's end kept."""
    model, times = looped_model(bricard()), np.linspace(0.0, 2.0, 5)
    own, other = (
        model.simulate(2.0, method, rtol=1e-8, output_times=times)
        for method in ("dop853", "scipy-DOP853")
    )
    np.testing.assert_allclose(own.q, other.q, atol=1e-8)
