"""States that move: what a frequency response can be asked there.

Increments go along with the motion, those of hinges in axes that turn.  They answer a push of one
frequency with that frequency alone where neither the matrices nor the push, nor what is read,
change along the motion or with time: an effort of a hinge stays what it is, a force with inertial
components on a body that turns goes round, and so does the place of its end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from mstmm.errors import SceneError
from mstmm.risk import Risk
from mstmm.safe_text import abbreviate_names

from ..input_channels import Channel
from ..operating_point.changes import MATRICES, find_changes
from ..operating_point.departure import find_departure
from ..operating_point.later import LaterStates
from ..outputs.output_rows import LinearQuantity
from ..validity import changing_risk

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations


def refuse_turning(linear: LinearEquations) -> None:
    """SceneError for exact beams beside a state that turns a ball: they have no matrices."""
    if linear.turning is not None:
        raise SceneError(
            "exact: the state turns a ball, a free or another hinge whose rates go by its "
            "coordinates; ask about a state at rest, or leave beams their shapes"
        )


def refuse_unsteady(
    linear: LinearEquations, pushes: Sequence[Channel], shown: Sequence[LinearQuantity]
) -> None:
    """SceneError where what is asked changes along the motion of the state."""
    later = LaterStates(linear)
    if not linear.state.u.any() and not later.driven:
        return
    changing = find_changes(linear, later, pushes, shown)
    if linear.turning is not None and (leaving := find_departure(linear)) is not None:
        changing += leaving.coordinates
    if changing:
        raise SceneError(
            "frequency response: the state moves, and along its motion changes "
            f"{abbreviate_names(changing)}, so that other frequencies answer too; push by "
            "efforts of hinges and read their coordinates and speeds, in axes that turn along, "
            "or ask about a state at rest"
        )


def refuse_turning_outputs(linear: LinearEquations, shown: Sequence[LinearQuantity]) -> None:
    """SceneError for outputs that change along a motion that is steady else: where it is not, the
    risks of the linear model say so."""
    if not linear.state.u.any():
        return
    later = LaterStates(linear)
    changing = find_changes(linear, later, (), shown)
    if changing and MATRICES not in changing and find_departure(linear, later) is None:
        raise SceneError(
            f"outputs: the state moves, and {abbreviate_names(changing)} changes along its "
            f"motion, so "
            "that no constant matrix gives it; read coordinates and speeds of hinges"
        )


def find_time_risks(
    linear: LinearEquations, pushes: Sequence[Channel], shown: Sequence[LinearQuantity]
) -> Iterator[Risk]:
    """Inputs and outputs whose effects change with time."""
    known = {risk.element for risk in linear.risks}
    for name in find_changes(linear, LaterStates(linear), pushes, shown):
        if name != MATRICES and f'input "{name}"' not in known:
            yield changing_risk(linear, name)
