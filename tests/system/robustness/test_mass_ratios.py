"""Mass ratios along a chain: what they cost the Riccati sweep, and that the run says so.

A heavy tip behind light links is the sweep's own weak side: S - S H D^-1 H^T S loses about as many
digits as the ratio of the masses has.  Heavy roots and light tips cost nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.support.scenes.rods import chain, drawn_state, precise_accelerations

COUNT = 8


ENGINES = pytest.mark.parametrize("engine", ["looped", "fused"])


def errors(
    masses: Sequence[float], kind: str, engine: str, rng: np.random.Generator
) -> tuple[float, float]:
    """Middle and worst one of five states."""
    scene = chain([kind] * len(masses), 0.6, masses)
    model, found = mstmm.compile(mstmm.Scene(**scene), engine=engine), list[float]()
    for _ in range(5):
        q, u = drawn_state(scene, rng)
        found.append(worst(model.accelerations(q, u), precise_accelerations(scene, q, u)))
    return float(np.median(found)), max(found)


@pytest.mark.parametrize("power", range(0, 9, 2))
@pytest.mark.parametrize("kind", ["pin", "ball"])
@ENGINES
def test_heavy_tip(engine: str, kind: str, power: int, rng: np.random.Generator) -> None:
    masses = [1.0] * (COUNT - 1) + [10.0**power]
    middle, largest = errors(masses, kind, engine, rng)
    assert middle < 1e-14 + 1e-15 * 10**power
    assert largest < 1e-14 + 5e-15 * 10**power


@pytest.mark.parametrize("kind", ["pin", "ball"])
@ENGINES
def test_heavy_root(engine: str, kind: str, rng: np.random.Generator) -> None:
    assert max(errors([1e8] + [1.0] * (COUNT - 1), kind, engine, rng)) < 2e-14


@pytest.mark.parametrize(("ratio", "bound"), [(0.1, 2e-14), (0.01, 2e-14), (10.0, 1e-10)])
@ENGINES
def test_ratio_chains(engine: str, ratio: float, bound: float, rng: np.random.Generator) -> None:
    """Every body `ratio` times as heavy as the one before."""
    assert max(errors([ratio**k for k in range(COUNT)], "pin", engine, rng)) < bound


def test_product_fails_for_light_tips_where_the_sweep_does_not(rng: np.random.Generator) -> None:
    scene = chain(["pin"] * 12, masses=[0.1**k for k in range(12)])
    q, u = drawn_state(scene, rng)
    expected = precise_accelerations(scene, q, u)
    product = mstmm.compile(mstmm.Scene(**scene), sweep="product", accuracy=np.inf)
    assert worst(product.accelerations(q, u), expected) > 1e-6
    assert worst(mstmm.compile(mstmm.Scene(**scene)).accelerations(q, u), expected) < 2e-14


@pytest.mark.parametrize(("mass", "warns"), [(1e4, False), (1e11, True)])
def test_the_certificate_warns_of_a_heavy_tip(mass: float, warns: bool) -> None:
    scene = chain(["pin"] * 4, masses=[1.0, 1.0, 1.0, mass])
    result = mstmm.compile(mstmm.Scene(**scene), sweep="riccati").simulate(1e-3)
    assert any("heavy body outboard of light ones" in text for text in result.warnings) == warns
