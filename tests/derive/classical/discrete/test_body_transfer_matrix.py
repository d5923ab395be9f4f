"""Products of discrete-time classical matrices against the Riccati steps, mixed chains, 80 digits.

The steps work on bodies of particles whose linear form comes from differences, so that they share
nothing with the kernels but the numbers.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from tests.support.classical.discrete_bodies import DIGITS
from tests.support.classical.discrete_chain import by_product, by_steps, random_chain

#: Share of the largest entry of a state.
LIMIT = 1e-35

PLANAR = (
    "fixed beam", "smooth beam", "spring beam", "smooth rigid", "spring rigid",
    "smooth beam, smooth beam, smooth rigid", "smooth rigid, smooth beam, smooth rigid",
    "fixed beam, spring beam, fixed rigid", "spring rigid, fixed beam, fixed beam",
    "fixed rigid, spring beam, spring rigid",
)  # fmt: skip
SPATIAL = (
    "fixed beam", "ball beam", "pin beam", "elastic beam", "elastic rigid",
    "ball beam, ball beam, ball rigid", "ball rigid, ball beam",
    "pin beam, pin beam, pin rigid", "pin rigid, pin beam",
    "elastic beam, elastic beam, fixed rigid", "fixed rigid, elastic beam, elastic rigid",
    "elastic rigid, fixed beam, fixed beam",
)  # fmt: skip


def plan(words: str) -> list[tuple[str, str]]:
    pairs = [part.split() for part in words.split(", ")]
    return [(hinge, body) for hinge, body in pairs]


def worst(words: str, planar: bool, rng: np.random.Generator) -> float:
    chain = random_chain(rng, planar, plan(words))
    pairs = zip(by_product(chain), by_steps(chain), strict=True)
    states = [pair for ends in pairs for pair in zip(*ends, strict=True)]
    with mpmath.workdps(DIGITS):
        return max(
            float(mpmath.norm(product - steps, mpmath.inf) / mpmath.norm(steps, mpmath.inf))
            for product, steps in states
        )


@pytest.mark.parametrize("words", PLANAR)
def test_planar_chain(words: str, rng: np.random.Generator) -> None:
    assert worst(words, True, rng) < LIMIT


@pytest.mark.parametrize("words", SPATIAL)
def test_spatial_chain(words: str, rng: np.random.Generator) -> None:
    assert worst(words, False, rng) < LIMIT
