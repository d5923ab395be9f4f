"""Validity of frequency responses about moving states.

Perturbations follow the motion, those of hinges in rotating axes.  The response to a harmonic input
has the frequency of the input alone only if matrices, inputs and outputs are constant along the
motion and over time.  Hinge efforts are constant; a force with inertial components on a rotating
body is not, nor is the position of an end of that body.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from mstmm.display import abbreviate_names
from mstmm.errors import SceneError
from mstmm.risk import Risk

from ..input_channels import Channel
from ..operating_point.changes import MATRICES, find_changes
from ..operating_point.departure import find_departure
from ..operating_point.later_states import LaterStates
from ..outputs.output_rows import LinearQuantity
from ..validity import changing_risk

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations


def reject_rotating_balls(linear: LinearEquations) -> None:
    """Raise SceneError for exact beams about a state with rotating balls: no matrices exist."""
    if linear.rate_matrix is not None:
        raise SceneError(
            "exact: a ball, free or similar hinge rotates at this state, so that its rates depend "
            "on its coordinates; use a state at rest, or shape functions"
        )


def check_steady(
    linear: LinearEquations, pushes: Sequence[Channel], shown: Sequence[LinearQuantity]
) -> None:
    """Raise SceneError where matrices, inputs or outputs change along the motion."""
    later = LaterStates(linear)
    if not linear.state.u.any() and not later.driven:
        return
    changing = find_changes(linear, later, pushes, shown)
    if linear.rate_matrix is not None and (leaving := find_departure(linear)) is not None:
        changing += leaving.coordinates
    if changing:
        raise SceneError(
            "frequency response: not constant along the motion of this state: "
            f"{abbreviate_names(changing)}, so that the response contains other frequencies; use "
            "efforts, coordinates and speeds of hinges, in rotating axes, or a state at rest"
        )


def check_steady_outputs(linear: LinearEquations, shown: Sequence[LinearQuantity]) -> None:
    """Raise SceneError for outputs that change along an otherwise steady motion.

    Unsteady motions are reported by the risks of the linear model instead.
    """
    if not linear.state.u.any():
        return
    later = LaterStates(linear)
    changing = find_changes(linear, later, (), shown)
    if changing and MATRICES not in changing and find_departure(linear, later) is None:
        raise SceneError(
            f"outputs: no constant matrix gives {abbreviate_names(changing)}, because it changes "
            "along the motion of this state; use coordinates and speeds of hinges"
        )


def find_time_risks(
    linear: LinearEquations, pushes: Sequence[Channel], shown: Sequence[LinearQuantity]
) -> Iterator[Risk]:
    """Risks of inputs and outputs whose effects change with time."""
    known = {risk.element for risk in linear.risks}
    for name in find_changes(linear, LaterStates(linear), pushes, shown):
        if name != MATRICES and f'input "{name}"' not in known:
            yield changing_risk(linear, name)
