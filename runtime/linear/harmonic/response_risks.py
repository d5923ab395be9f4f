"""Validity of frequency responses: moving states, beams without shape functions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.display import abbreviate_names
from mstmm.errors import MstmmError, SceneError
from mstmm.risk import Risk, information

from ...packing.scene_parameters import scene_data, scene_from_data
from ...result.flexible.missing_shapes import unshaped_directions
from ..input_channels import Channel
from ..operating_point.departure import MATRICES, find_changes, find_departure
from ..operating_point.later_states import LaterStates
from ..outputs import LinearQuantity
from ..validity import changing_risk

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ..linear_equations import LinearEquations
    from ..operating_point.friction import Amplitudes


# --- moving states --------------------------------------------------------------------------------
#
# Perturbations follow the motion, those of hinges in rotating axes.  The response to a harmonic
# input has the frequency of the input alone only if matrices, inputs and outputs are constant along
# the motion and over time.  Hinge efforts are constant; a force with inertial components on a
# rotating body is not, nor is the position of an end of that body.


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


# --- beam directions without shape functions ------------------------------------------------------
#
# A beam is rigid in a direction without shape functions, so a response that excites this direction
# is wrong at any frequency.  Comparison with the response of the scene with added shape functions
# gives the error.

#: Shape functions added to a direction, number of frequencies compared, and largest acceptable
#: relative change of the response.
_SHAPES, _FREQUENCIES, _CHANGE = 2, 7, 0.1

#: Response (k, outputs, inputs) and its rounding error (outputs, inputs) at omega (k,), rad/s.
Response = Callable[
    ["LinearEquations", Sequence[Channel], Array], tuple[NDArray[np.complex128], Array]
]


@runtime_checkable
class Linearisable(Protocol):
    """Model that can be linearised about its states."""

    def linearize(
        self, q: Array, u: Array, t: float, *, inputs: Sequence[str], friction: Amplitudes
    ) -> LinearEquations: ...


def unshaped_response_risks(
    linear: LinearEquations, inputs: Sequence[Channel], omega: Array, response: Response
) -> Iterator[Risk]:
    """Risks of beam directions without shapes that change the response at omega (k,), rad/s."""
    lacking = {
        name: directions
        for name, body in linear.model.flexible_bodies.items()
        if (directions := [d for d in unshaped_directions(body) if d != "axial"])
    }
    if not lacking or linear.frame_transform is not None:
        return
    picked = np.unique(np.linspace(0, len(omega) - 1, _FREQUENCIES).astype(int))
    try:
        fuller = _with_shapes(linear, inputs, lacking)
        given, _ = response(linear, inputs, omega[picked])
        expected, rounding = response(fuller, fuller.input_channels, omega[picked])
    except MstmmError as failure:  # undamped resonance, or the scene rejects the added shapes
        yield information(
            "unexamined", "the response",
            f"not examined for directions of beams without shapes: {failure}",
            "add shapes in these directions, or compare with a simulation",
        )  # fmt: skip
        return
    size = np.maximum(np.abs(given), np.abs(expected)).max(axis=0)
    change = np.abs(given - expected).max(axis=0)
    share = np.divide(change, size, out=np.zeros_like(size), where=change > rounding)
    if (worst := float(share.max())) > _CHANGE:
        name, directions = next(iter(lacking.items()))
        more_beams_text = f" (and {len(lacking) - 1} more beams)" if len(lacking) > 1 else ""
        yield Risk(
            "shapes", f'"{name}"',
            f'"{name}"{more_beams_text} has no shapes of {" and ".join(directions)}: with them the '
            f"response changes by {worst:.0%}",
            f"add {', '.join(f'{d} = {_SHAPES}' for d in directions)} to its modes",
            worst, _CHANGE,
        )  # fmt: skip


def _with_shapes(
    linear: LinearEquations, inputs: Sequence[Channel], lacking: Mapping[str, Sequence[str]]
) -> LinearEquations:
    """Linear model at the same state with shape functions added in the `lacking` directions."""
    model, state = linear.model, linear.state
    data = scene_data(model.scene)
    for beam in data["beam"]:
        if beam["name"] in lacking:
            body = model.flexible_bodies[beam["name"]]
            for key in ("initial", "shapes"):
                beam.pop(key, None)
            counts = Counter(mode.rstrip("0123456789") for mode in body.modes)
            beam["modes"] = {**counts, **dict.fromkeys(lacking[beam["name"]], _SHAPES)}
            beam["frame"] = body.frame
    shaped_model = type(model)(scene_from_data(data, model.scene), model.known)
    assert isinstance(shaped_model, Linearisable)
    amplitudes = None if linear.dry is None else linear.dry.amplitudes
    return shaped_model.linearize(
        _reorder_modes(state.q, "q_slice", model, shaped_model),
        _reorder_modes(state.u, "u_slice", model, shaped_model), state.t,
        inputs=[channel.name for channel in inputs], friction=amplitudes,
    )  # fmt: skip


def _reorder_modes(
    values: Array, part: str, model: CompiledScene, shaped_model: CompiledScene
) -> Array:
    """Coordinates or speeds of `model` in the order of `shaped_model`, zero for added shapes."""
    slices = [getattr(slots, part) for slots in model.coordinate_layout.modal.values()]
    hinges = min(part_slice.start for part_slice in slices)
    pieces = [values[:hinges]]
    for name in shaped_model.coordinate_layout.modal:
        own = values[getattr(model.coordinate_layout.modal[name], part)]
        modes = dict(zip(model.flexible_bodies[name].modes, own, strict=True))
        pieces.append(
            np.array([modes.get(mode, 0.0) for mode in shaped_model.flexible_bodies[name].modes])
        )
    return np.concatenate(pieces)
