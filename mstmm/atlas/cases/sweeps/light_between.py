"""Fastest motion of heavy bodies with light ones between them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ....array_validation import Array
from ....runtime.model.model import Model
from ....runtime.run.spectral_radius import fastest_at_start
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped
from ...variants import pivot_frequency_estimate

#: Number of bodies, large enough that the fastest motion is found by power iterations.
BODY_COUNT = 14
#: Stiffness of the springs inboard and outboard of light bodies, N/m.
SOFT_STIFFNESS, HIGH_STIFFNESS = 1.0, 1e6


def _body_chain(masses: Array, springs: Array) -> Model:
    """Chain of bodies on slides along one line."""
    bodies = [{"name": f"body{i}", "mass": mass} for i, mass in enumerate(masses.tolist())]
    hinges = [
        {"name": f"slide{i}", "type": "prismatic", "axis": [1, 0, 0], "outboard": f"body{i}",
         "inboard": f"body{i - 1}" if i else "ground", "law": {"stiffness": spring}}
        for i, spring in enumerate(springs.tolist())
    ]  # fmt: skip
    return compile_looped({"gravity": [0, 0, 0], "body": bodies, "hinge": hinges})


def _exact_rate(masses: Array, springs: Array) -> float:
    """Exact |lambda| of the fastest motion, from displacements relative to the ground."""
    stretch = np.eye(BODY_COUNT) - np.eye(BODY_COUNT, k=-1)
    weighted = np.sqrt(springs)[:, None] * stretch / np.sqrt(masses)
    return float(np.linalg.norm(weighted, 2))


def _underestimation(ratio: float, estimate: Callable[[Model], float]) -> float:
    is_light = np.arange(BODY_COUNT) % 2 == 0
    masses, springs = (
        np.where(is_light, 1.0, ratio),
        np.where(is_light, SOFT_STIFFNESS, HIGH_STIFFNESS),
    )
    return _exact_rate(masses, springs) / estimate(_body_chain(masses, springs))


def _rate_by_iterations(model: Model) -> float:
    return fastest_at_start(model.looped, 0.0, *model.initial_state())


CASE = CaseDefinition(
    name="light-between",
    title="Fastest motion by pivots: a light body between heavy ones",
    cause="The sweep divides by the inertia D that a hinge moves outboard of it. The stiffness "
    "over D is no squared frequency, because the inboard side moves too. Where the inboard side is "
    "light and softly supported, it is the part that vibrates. Explicit steps chosen by k/D are "
    "then too long by the root of the mass ratio. A few power iterations with M^-1, each two "
    "passes over the bodies, include both sides.",
    parameter="mass of the heavy bodies over that of the light ones",
    unit="",
    low=1.0,
    high=1e6,
    scale=LOG_SCALE,
    measured="fastest frequency over the one found",
    limit=2.0,
    method=MethodDefinition(
        "stiffness over pivots of the sweep",
        lambda x: _underestimation(x, pivot_frequency_estimate.fastest_rate),
    ),
    remedy=MethodDefinition(
        "four power iterations", lambda x: _underestimation(x, _rate_by_iterations)
    ),
    reach=1e12,
    source="Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 7 (D); Golub, Van Loan, Matrix "
    "Computations, 4th ed., 2013, 8.2 (power iteration)",
)
