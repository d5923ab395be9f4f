"""Cases of sweeps over the bodies."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...array_validation import Array
from ...errors import NumericalFailure, SceneError
from ...runtime.model.model import Model
from ...runtime.run.spectral_radius import fastest_at_start
from ..case_definition import LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import rounding_error
from ..shared_scenes import ROD_TRANSVERSE_INERTIA, compile_looped, random_pin_states, rod_chain

# --- heavy-tip ------------------------------------------------------------------------------------

ROD_COUNT = 8


def _tip_error(ratio: float, sweep: str) -> float:
    """Largest relative error of the accelerations over some random states."""
    scene = rod_chain([1.0] * (ROD_COUNT - 1) + [ratio])
    return rounding_error(compile_looped(scene, sweep=sweep), random_pin_states(ROD_COUNT))


HEAVY_TIP = CaseDefinition(
    name="heavy-tip",
    title="Riccati sweep: a heavy body outboard of light ones",
    cause="The sweep subtracts from the inertia that a hinge carries the part that moves freely in "
    "the hinge. Three hinges inboard of a heavy tip, in a plane, only rounding is left of its "
    "inertia, next to the inertia of light links. Least squares carry rows, whose sums of squares "
    "are both inertias: rotations combine them without a difference.",
    parameter="mass of the last rod over that of the others", unit="", low=1.0, high=1e12,
    scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-8,
    method=MethodDefinition(
        f"Riccati sweep, {ROD_COUNT} rods", lambda ratio: _tip_error(ratio, "riccati")
    ),
    remedy=MethodDefinition('least squares (sweep="qr")', lambda ratio: _tip_error(ratio, "qr")),
    reach=1e20,
    source="Bjoerck, Numerical Methods for Least Squares Problems, SIAM 1996, ch. 2 and 4 (normal "
    "equations, weighted rows); sweep: Rui et al., Multibody System Dynamics 49, 2020",
)  # fmt: skip


# --- refined-tip ----------------------------------------------------------------------------------


def _refined_error(ratio: float) -> float:
    try:
        return _tip_error(ratio, "refined")
    except SceneError as failure:  # refinement does not converge any more
        raise NumericalFailure(str(failure)) from None


REFINED_TIP = CaseDefinition(
    name="refined-tip",
    title="Refined sweep: a heavy body outboard of light ones",
    cause="Inverse dynamics eliminates nothing: the residual that it gives for the accelerations "
    "is accurate. The sweep solves for it with the digits that it has, so that each refinement "
    "reduces the error by the relative error of the sweep. Up to four are made, as many as the "
    "start needs. Where the sweep has no accurate digit, refinement fails.",
    parameter="mass of the last rod over that of the others", unit="", low=1e8, high=1e18,
    scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-8,
    method=MethodDefinition(f'refined (sweep="refined"), {ROD_COUNT} rods', _refined_error),
    remedy=MethodDefinition('least squares (sweep="qr")', lambda ratio: _tip_error(ratio, "qr")),
    reach=1e20,
    source="Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, ch. 12 (iterative "
    "refinement)",
)  # fmt: skip


# --- pivot frequency estimate ---------------------------------------------------------------------
#
# Estimate of the fastest motion of a chain of bodies from the pivots of the sweep.


def fastest_rate(model: Model) -> float:
    """|lambda| (1/s) at the start of a chain: root of the largest k/D of a hinge.

    k is the stiffness of the hinge and D the inertia by which the sweep divides, that of the
    outboard bodies, as if the inboard side did not move.
    """
    q, u = model.initial_state()
    inertia = model.mass_matrix(q)
    stiffness = -inertia @ model.derivatives(q, u).q
    pivots = np.diag(np.linalg.cholesky(inertia[::-1, ::-1]))[::-1] ** 2
    return float(np.sqrt(np.max(np.diag(stiffness) / pivots)))


# --- light-between --------------------------------------------------------------------------------

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


LIGHT_BETWEEN = CaseDefinition(
    name="light-between",
    title="Fastest motion by pivots: a light body between heavy ones",
    cause="The sweep divides by the inertia D that a hinge moves outboard of it. The stiffness "
    "over D is no squared frequency, because the inboard side moves too. Where the inboard side is "
    "light and softly supported, it is the part that vibrates. Explicit steps chosen by k/D are "
    "then too long by the root of the mass ratio. A few power iterations with M^-1, each two "
    "passes over the bodies, include both sides.",
    parameter="mass of the heavy bodies over that of the light ones", unit="", low=1.0, high=1e6,
    scale=LOG_SCALE,
    measured="fastest frequency over the one found", limit=2.0,
    method=MethodDefinition(
        "stiffness over pivots of the sweep", lambda x: _underestimation(x, fastest_rate)
    ),
    remedy=MethodDefinition(
        "four power iterations", lambda x: _underestimation(x, _rate_by_iterations)
    ),
    reach=1e12,
    source="Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 7 (D); Golub, Van Loan, Matrix "
    "Computations, 4th ed., 2013, 8.2 (power iteration)",
)  # fmt: skip


# --- thin-rod -------------------------------------------------------------------------------------

#: Direction of the rod in the axes of its body, and two directions normal to it.
ROD_AXIS = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
FIRST_NORMAL = np.array([3.0, 0.0, -1.0]) / np.sqrt(10.0)
SECOND_NORMAL = np.cross(ROD_AXIS, FIRST_NORMAL)

#: Hinges, and a state of each.
BALL = {"type": "ball"}
UNIVERSAL = {"type": "universal", "axis": FIRST_NORMAL.tolist(), "axis2": SECOND_NORMAL.tolist()}
BALL_STATE = np.array([0.5, 0.5, 0.5, 0.5]), np.array([0.7, -0.2, 0.4])
UNIVERSAL_STATE = np.array([0.3, -0.5]), np.array([0.7, -0.2])


def _rod_error(ratio: float, foot: dict[str, Any], state: tuple[Array, Array]) -> float:
    """Relative error of the accelerations of a rod of 1 m and 1 kg on the hinge `foot`.

    `ratio` is its moment of inertia about its axis over that across.
    """
    tensor = ROD_TRANSVERSE_INERTIA * (np.eye(3) + (ratio - 1) * np.outer(ROD_AXIS, ROD_AXIS))
    rod = {
        "name": "rod", "mass": 1.0, "center_of_mass": (ROD_AXIS / 2).tolist(),
        "inertia": [*np.diag(tensor).tolist(), *tensor[np.triu_indices(3, 1)].tolist()],
    }  # fmt: skip
    hinge = {"name": "foot", "inboard": "ground", "outboard": "rod"} | foot
    scene = {"gravity": [0, -9.81, 0], "body": [rod], "hinge": [hinge]}
    try:
        rod_model = compile_looped(scene)
    except SceneError as failure:  # the inertia is the only possible reason in this scene
        raise NumericalFailure(str(failure)) from None
    return rounding_error(rod_model, [state])


THIN_ROD = CaseDefinition(
    name="thin-rod",
    title="Riccati sweep: a hinge that rotates a body without inertia",
    cause="The sweep divides by the inertia D of the free motions of a hinge. A ball lets a rod "
    "spin about its axis, where there is hardly any inertia. In axes oblique to the rod that "
    "inertia is the difference of large entries: the spin is rounding over rounding. Below 1e-14 "
    "of the mean a pivot of D counts as zero, and the run stops and names the hinge. A motion "
    "without inertia should not be free: a universal hinge constrains the spin.",
    parameter="moment of inertia along a rod over that across", unit="",
    low=1e-18, high=0.1, scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-6,
    method=MethodDefinition("ball", lambda ratio: _rod_error(ratio, BALL, BALL_STATE)),
    remedy=MethodDefinition(
        "universal hinge, spin constrained", lambda x: _rod_error(x, UNIVERSAL, UNIVERSAL_STATE)
    ),
    reach=1e-20,
    source="Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 7 and 10 (D, singular "
    "articulated inertia); Higham, Accuracy and Stability of Numerical Algorithms, 2002, ch. 10",
)  # fmt: skip


CASES = (HEAVY_TIP, REFINED_TIP, LIGHT_BETWEEN, THIN_ROD)
