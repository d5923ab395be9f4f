"""Beams with exact dynamic stiffness instead of shape functions.

An exact beam keeps two shape functions in each bending plane and one each for twist and tension:
the displacements of its far end, which couple it to the outboard bodies.  At each s the dynamic
stiffness of frame and shapes replaces mass and stiffness of the body; the sweep is unchanged.  The
solution is that of a straight uniform Euler-Bernoulli beam, neither bent nor under tension at rest;
any other property of a beam is rejected by name.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.errors import SceneError
from mstmm.scene import split_reference
from mstmm.scene.tables.beam import DIRECTIONS
from mstmm.scene.validators.validation_messages import did_you_mean

from ...engine.tangent_matrix import Complex, DynamicStiffnessBodies, TangentMatrix
from ...flexible.beam.beam_data import BeamData, beam_data
from ...flexible.beam.boundary_conditions import BeamEnvironment, boundary_conditions
from ...flexible.beam.dynamic_stiffness import BENDING, HarmonicBeam, harmonic_beam
from ...flexible.modal_body import transform_body
from ...packing.scene_parameters import scene_data, scene_from_data
from ..frozen_loads import with_frozen_loads
from ..input_channels import GROUND, Channel, channel
from ..mck_matrices import State
from ..operating_point.friction import dry_friction
from .damping import Losses, loss_factor_lookup

if TYPE_CHECKING:
    from mstmm.scene.tables.beam import Beam

    from ...engine.compiled_scene import CompiledScene
    from ..linear_equations import LinearEquations

#: Which beams are exact: all beams of the scene, none, or the named ones.
BeamSelection = bool | Sequence[str]

#: Negligible deflection at rest, relative to the length; negligible stiffness due to tension,
#: relative to the elastic stiffness.
_STRAIGHT = 1e-6


@dataclass(frozen=True)
class ExactBeams:
    """Linear model with exact beams: `names` in the order of `beams`."""

    linear: LinearEquations
    names: tuple[str, ...]
    beams: tuple[HarmonicBeam, ...]

    @property
    def bodies(self) -> DynamicStiffnessBodies:
        """Bodies of the exact beams, with their dynamic stiffness, for the sweep."""
        positions = self.linear.model.packed_scene.positions
        return DynamicStiffnessBodies(
            tuple(positions[name] for name in self.names), self._stiffness
        )

    def _evaluate_beams(self, of: Callable[[HarmonicBeam], Any]) -> list[Any]:
        """Value of `of` for each beam, computed once for equal beams."""
        distinct = {id(beam): beam for beam in self.beams}
        values_by_key = {key: of(beam) for key, beam in distinct.items()}
        return [values_by_key[id(beam)] for beam in self.beams]

    def _stiffness(self, s: Complex) -> list[Complex]:
        return self._evaluate_beams(lambda beam: beam.stiffness(s))

    def clamped_mode_count(self, omega: Array) -> Integers:
        """Number (k,) of clamped-clamped modes of all exact beams below omega (k,), rad/s."""
        return np.asarray(
            sum(self._evaluate_beams(lambda beam: beam.clamped_mode_count(omega))), dtype=np.int64
        )

    @property
    def slowest(self) -> float:
        """Scale of the lowest frequency of the exact beams, rad/s."""
        return min(beam.frequency for beam in self.beams)

    def without_damping(self) -> ExactBeams:
        """The same model with undamped exact beams."""
        return replace(self, beams=tuple(self._evaluate_beams(HarmonicBeam.without_damping)))

    def has_coordinate(self, coordinate: str) -> bool:
        """Whether a coordinate belongs to an exact beam."""
        return coordinate.partition(".")[0] in self.names


def exact_beams(linear: LinearEquations, chosen: BeamSelection, losses: Losses) -> ExactBeams:
    """Linear model with the `chosen` beams exact.

    Raises SceneError for names that are no flexible beams, and for beams and states outside the
    validity of the solution.
    """
    if linear.constrained_motion is not None:
        raise SceneError(
            "exact: expected a tree, found closed loops; open them, or use shape functions"
        )
    if linear.state.u.any():
        raise SceneError("exact: expected a state at rest, found a moving one; use shape functions")
    model, names = linear.model, _names(linear.model, chosen)
    gravity = model.scene.gravity
    if any(gravity):
        raise SceneError(
            f"exact: gravity = {list(gravity)} loads the beams, whose exact solution is that of "
            "straight beams without tension; give gravity = [0, 0, 0], or use shape functions"
        )
    around = BeamEnvironment(model.scene)
    tables = {beam.name: beam for beam in model.scene.beam if beam.name in names}
    for name in names:
        data = beam_data(tables[name])
        held = boundary_conditions(around, tables[name], data)
        _check_beam(tables[name], data, [held.x, *(end.x for end in held.ends)])
    shaped = _with_ends_as_shapes(linear, names)
    lossy = loss_factor_lookup(shaped.model, losses)
    beams = _distinct(shaped, tables, names, [lossy(name) for name in names])
    _check_straight(shaped, linear, tables, names)
    return ExactBeams(shaped, names, beams)


def _names(model: CompiledScene, chosen: BeamSelection) -> tuple[str, ...]:
    flexible = [
        beam.name for beam in model.scene.beam if beam.name in model.coordinate_layout.modal
    ]
    if chosen is True:
        if not flexible:
            raise SceneError("exact: the scene has no flexible beam")
        return tuple(flexible)
    if isinstance(chosen, str) or not isinstance(chosen, Sequence):
        raise SceneError(f"exact = {chosen!r}: expected True, or a list of names of beams")
    if not chosen:
        raise SceneError("exact is empty: expected names of beams; give some, or leave it out")
    for name in chosen:
        if name not in flexible:
            raise SceneError(
                f'exact: "{name}": expected a flexible '
                f"beam{did_you_mean(str(name), sorted(flexible))}"
            )
    return tuple(dict.fromkeys(chosen))


def _check_beam(beam: Beam, data: BeamData, positions: Sequence[float]) -> None:
    """Raise SceneError for beam properties that the solution does not cover."""
    inner = [x for x in positions if x not in (0.0, data.length)]
    problem = ""
    if not data.uniform:
        problem = "is not uniform; divide it into uniform welded beams"
    elif data.rotary:
        problem = "has rotary inertia, which the exact solution neglects; remove it"
    elif inner:
        problem = (
            f"is supported or loaded at x = {inner[0]:g} m; divide it into two welded beams there"
        )
    elif any(beam.damping.ratio):
        problem = (
            "has modal damping ratios, but no shape functions if exact; give "
            f'damping = {{ stiffness = ... }}, or structural = {{"{beam.name}": ...}}'
        )
    elif any(beam.damping.strain):
        problem = "has damping by strain; give damping = { stiffness = ... }"
    if problem:
        raise SceneError(f'exact: beam "{beam.name}" {problem}, or do not make it exact')


def _with_ends_as_shapes(linear: LinearEquations, names: Sequence[str]) -> LinearEquations:
    """The same model with the displacements of the beams' far ends as shape functions."""
    model = linear.model
    data = scene_data(model.scene)
    for beam in data["beam"]:
        if beam["name"] in names:
            _reshape(beam, model.flexible_bodies[beam["name"]].modes)
    shaped_model = type(model)(scene_from_data(data, model.scene), model.known)
    q = np.zeros(shaped_model.nq)
    hinges = min((slots.q for slots in model.coordinate_layout.modal.values()), default=model.nq)
    q[:hinges] = linear.state.q[:hinges]
    for name, slots in model.coordinate_layout.modal.items():
        if name not in names:
            q[shaped_model.coordinate_layout.modal[name].q_slice] = linear.state.q[slots.q_slice]
    still = np.zeros(shaped_model.nu)
    state = State.moving(shaped_model.looped, linear.state.t, q, still)
    dry = None if linear.dry is None else dry_friction(shaped_model, still, linear.dry.amplitudes)
    return replace(
        linear, model=shaped_model, state=state, dry=dry,
        input_channels=tuple(channel(shaped_model, given.name) for given in linear.input_channels),
        disturbance_channels=tuple(
            channel(shaped_model, given.name) for given in linear.disturbance_channels
        ),
    )  # fmt: skip


def _reshape(beam: dict[str, Any], modes: Sequence[str]) -> None:
    directions = dict.fromkeys(name.rstrip("0123456789") for name in modes)
    for key in ("shapes", "initial", "kinematics"):
        beam.pop(key, None)
    beam |= {
        "basis": "static+fixed-interface", "frame": "tangent", "quadrature": False,
        "modes": {d: 2 if d in BENDING else 1 for d in directions},
    }  # fmt: skip


def _distinct(
    linear: LinearEquations, tables: dict[str, Beam], names: Sequence[str], losses: Sequence[float]
) -> tuple[HarmonicBeam, ...]:
    """Harmonic beams; equal beams share one object."""
    packed, known = linear.model.packed_scene, dict[tuple[object, ...], HarmonicBeam]()
    beams = []
    for name, loss in zip(names, losses, strict=True):
        placement = packed.placements[name]
        turn = np.array(placement.rotation)
        body = transform_body(packed.flexible[name], turn, np.array(placement.origin))
        beam = harmonic_beam(
            beam_data(tables[name]), body, turn.T, tables[name].damping.stiffness, loss
        )
        beams.append(known.setdefault(beam.cache_key, beam))
    return tuple(beams)


# --- rest -----------------------------------------------------------------------------------------


def _check_straight(
    linear: LinearEquations, given: LinearEquations, tables: dict[str, Beam], names: Sequence[str]
) -> None:
    """Raise SceneError for beams that are bent or under axial load at rest."""
    model, state = linear.model, linear.state
    still = np.zeros(model.nu)
    memory = model.looped.start_memory()
    missing = model.looped.inverse_dynamics(state.t, state.q, still, still, memory)
    x = still.copy()
    for name in names:
        slots = model.coordinate_layout.modal[name].u_slice
        x[slots] = np.random.default_rng(0).uniform(0.5, 1.0, slots.stop - slots.start)
    pulled = _stiffness(linear, x)
    for name in names:
        slots, stiffness = (
            model.coordinate_layout.modal[name].u_slice,
            model.flexible_bodies[name].K,
        )
        bent = np.abs(np.linalg.solve(stiffness, missing[slots])).max()
        start = np.abs(given.state.q[given.model.coordinate_layout.modal[name].q_slice]).max(
            initial=0
        )
        if max(bent, start) > _STRAIGHT * tables[name].length:
            raise SceneError(
                f'exact: beam "{name}" is bent at rest, but the exact solution is that of a '
                "straight beam; remove the load that bends it, or use shape functions"
            )
        elastic = stiffness @ x[slots]
        if np.abs(pulled[slots] - elastic).max() > _STRAIGHT * np.abs(elastic).max():
            raise SceneError(
                f'exact: beam "{name}" is under tension or compression at rest, which changes '
                "its stiffness; remove the load, or use shape functions"
            )


def _stiffness(linear: LinearEquations, x: Array) -> Array:
    """Product K x for flexible bodies and loads frozen at the state, without laws and springs."""
    state = linear.state
    tangent = TangentMatrix(with_frozen_loads(linear.model.looped, state))
    moved = tangent.rates(state.q, x)
    tangent.residual(state.t, state.q, state.u, state.udot)
    still = np.zeros(len(x))
    return tangent.slope(0.0, moved, still, still)


def reject_distributed(beams: ExactBeams, pushes: Sequence[Channel]) -> None:
    """Raise SceneError for distributed inputs on exact beams, which accept loads at ends only."""
    scene = beams.linear.model.scene
    loaded = any(
        load.force_per_length is not None and split_reference(load.on)[0] in beams.names
        for load in scene.load
    )
    for push in pushes:
        if push.name in GROUND or (push.input >= 0 and loaded):
            raise SceneError(
                f'"{push.name}" acts along the whole beam "{beams.names[0]}", but exact beams '
                "accept loads at their ends only; use forces at ends, or shape functions"
            )


def reject_inner_names(beams: ExactBeams, names: Sequence[str]) -> None:
    """Raise SceneError for inputs and outputs that exact beams do not provide.

    These are modal coordinates, and ends between root and tip.
    """
    tables = {beam.name: beam for beam in beams.linear.model.scene.beam}
    for signal in names:
        name, rest = split_reference(signal)
        if name not in beams.names:
            continue
        beam, end = tables[name], rest.partition(".")[0]
        if end in beam.ends and beam.end_x(end) not in (0.0, beam.length):
            raise SceneError(
                f'"{signal}": exact beams have outputs at root and tip only; divide the beam there'
            )
        if end not in beam.ends and end.rstrip("0123456789_rate") in DIRECTIONS:
            raise SceneError(
                f'"{signal}": beam "{name}" is exact and has no modal coordinates; use an end'
            )
