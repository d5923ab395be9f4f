"""Beams with modal columns in the state vectors, in all pairings of the hinges."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.support.scenes.classical import held_beam

RICCATI, PRODUCT = "dttmm-classical", "dttmm-classical-product"
KINDS = ("fixed", "pin", "ball", "elastic", "sprung pin")


def errors(scene: mstmm.Scene, steps: tuple[float, ...], t_end: float = 0.2) -> list[float]:
    """Largest errors of q at the end against our ordinary engine."""
    model = mstmm.compile(scene)
    exact = model.simulate(t_end, rtol=1e-11, atol=1e-12, output_times=[t_end])
    found = []
    for step in steps:
        run = model.simulate(t_end, RICCATI, step, output_times=[t_end])
        assert run.success
        found.append(float(np.abs(run.q[-1] - exact.q[-1]).max()))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_beam_on_a_hinge_tends_to_the_ordinary_engine(kind: str) -> None:
    coarse, fine = errors(held_beam(kind), (0.001, 0.0005))
    assert fine < 3e-5
    assert 3.2 < coarse / fine < 5


@pytest.mark.parametrize("outboard", ["rigid", "beam"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_a_beam_carries_tends_to_the_ordinary_engine(kind: str, outboard: str) -> None:
    """The pairings beam to rigid body and beam to beam; ground to beam is the hinge before."""
    coarse, fine = errors(held_beam("elastic", kind, outboard), (0.0005, 0.00025))
    assert fine < 1e-6
    assert 3.3 < coarse / fine < 5


@pytest.mark.parametrize("outboard", ["rigid", "beam"])
@pytest.mark.parametrize("held, kind", [("fixed", k) for k in KINDS] + [("pin", "pin"),
                                       ("ball", "ball"), ("elastic", "fixed")])  # fmt: skip
def test_product_and_riccati_agree_on_beams(held: str, kind: str, outboard: str) -> None:
    model = mstmm.compile(held_beam(held, kind, outboard))
    runs = [model.simulate(0.05, method, 0.005) for method in (RICCATI, PRODUCT)]
    assert all(run.success for run in runs)
    assert runs[1].q == pytest.approx(runs[0].q, abs=1e-8)
