"""Linear model of a scene about a state, with its modes and responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from mstmm.argument_validation import abbreviate
from mstmm.array_validation import Array
from mstmm.display import PublicMembers
from mstmm.errors import SceneError
from mstmm.optional_packages import missing_package_error
from mstmm.risk import Risk

from ..packing.coordinate_layout import check_dense_size
from .frequency_response import FrequencyResponse, frequency_response
from .harmonic.damping import Losses, Ratios
from .harmonic.dynamic_stiffness_modes import DynamicStiffnessModes, exact_modes
from .harmonic.exact_beams import BeamSelection
from .harmonic.response_risks import check_steady_outputs
from .input_channels import Channel, some_names
from .mode_solvers import modes
from .modes import Modes
from .outputs import outputs_of, rows_of
from .rotors import fixed_frame_transform, frame_of
from .state_space import StateSpace
from .validity import find_linear_risks


class Linear(PublicMembers, StateSpace):
    """Linear model about an operating point: matrices, modes, responses; see `LinearEquations`."""

    member_groups: ClassVar[Mapping[str, str]] = {
        "Description": "model state frame coordinate_names coordinate_units input_names "
        "disturbance_names state_names prescribed_coordinates "
        "free_speed_indices position_states velocity_states",
        "Matrices": "M C K V W A B B_disturbances output_matrices C_prescribed K_prescribed "
        "has_stiffness",
        "Contributions": "K_elastic K_springs K_geometric K_load C_damping C_gyroscopic",
        "Analysis": "modes dynamic_stiffness_modes frequency_response expand "
        "displaced_state to_fixed_frame symbolic",
        "Verdict": "trusted verdict risks warnings",
        "Output": "plot save to_dict to_control",
    }

    def modes(self, count: int | None = None, damped: bool | None = None) -> Modes:
        """Normal modes: all, or the `count` slowest.

        C is included if it is nonzero, unless `damped` is False.  A small share of many modes is
        computed by shift-and-invert iteration with the O(bodies) solution.  Undamped modes are
        counted by the pivots of the sweep, so that none is missed.

        Raises SceneError for an invalid `count` or `damped`, NumericalFailure where a mode moves no
        inertia or the iteration does not converge.
        """
        if damped is not None and not isinstance(damped, bool | np.bool_):
            raise SceneError(f"damped = {abbreviate(damped)}: expected True, False or None")
        self.check_count(count, len(self))
        if count is None:
            check_dense_size(len(self), "the matrix of all modes")
        return modes(self, count, damped)

    @cached_property
    def frame(self) -> str:
        """Frame of x and of all frequencies, "fixed" or "rotating".

        It is "rotating" where coordinates rotate with bodies that spin at the state, so that
        frequencies are relative to the rotor.
        """
        return frame_of(self)

    def to_fixed_frame(self) -> Linear:
        """Linear model in the fixed frame, by an exact transformation.

        Increments of an axisymmetric rotor refer to non-rotating axes; those of its supports do not
        change.  Coordinates keep their names.  For three or more equal blades they are the pattern
        of the rotor at the current azimuths of the blades (multi-blade coordinates).  Inputs and
        outputs are those at the ends of bodies in inertial axes.

        Raises SceneError where a rotor is neither axisymmetric nor one of equal blades, or its
        coefficients change as it rotates.
        """
        if self.frame == "fixed":
            return self
        return replace(self, frame_transform=fixed_frame_transform(self))

    @staticmethod
    def check_count(count: int | None, most: int) -> None:
        """Raise SceneError for a number of modes other than None and 1 to `most`."""
        if count is None:
            return
        if not isinstance(count, (int, np.integer)):
            raise SceneError(f"count = {count!r}: expected a whole number of modes")
        if not most:
            raise SceneError(f"count = {count!r}: the scene has no degrees of freedom")
        if isinstance(count, bool) or not 0 < count <= most:
            raise SceneError(f"count = {count!r}: expected a number of modes from 1 to {most}")

    def frequency_response(
        self,
        omega: ArrayLike,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        *,
        structural: Losses = 0.0,
        modal: Ratios = 0.0,
        exact: BeamSelection = False,
    ) -> FrequencyResponse:
        """Frequency response at angular frequencies omega (k,) in rad/s, O(bodies) per frequency.

        `inputs` are names as in `Model.linearize`, by default those of v, or of w without v.
        `outputs` are coordinates ("shoulder.angle"), their rates ("shoulder.angle_rate"), motions
        of bodies and ends in inertial axes ("boom.tip.position.y", "boom.tip.vy",
        "boom.tip.angular_velocity.z"), "strut.length" and "strut.effort" of springs, and outputs of
        the scene, including expressions.  They are deviations from the state and, under
        accelerations of the ground, relative to the ground.  The default is the outputs of the
        scene, or all coordinates if it has none.

        Two kinds of damping can be added to that of the scene.  `structural` are loss factors eta:
        the stiffness k of laws, springs and flexible bodies becomes k (1 + i eta), for all of them
        or by names of hinges, chains, flexible bodies and springs; stiffness from expressions is
        lossless.  `modal` are damping ratios: one for all modes of the undamped scene (from its
        matrices), or one for each of the slowest modes (O(bodies) each); other modes do not change.

        `exact`, True for all or a list of names, replaces the shape functions of uniform beams by
        the exact dynamic stiffness in the directions that have shape functions: Euler-Bernoulli
        bending, torsion and tension, at any frequency.

        Raises SceneError for an invalid name or frequency, NumericalFailure at a resonance without
        damping.
        """
        return frequency_response(self, omega, inputs, outputs, structural, modal, exact)

    def dynamic_stiffness_modes(
        self, count: int, exact: BeamSelection = True
    ) -> DynamicStiffnessModes:
        """The `count` slowest undamped modes with exact beams.

        `exact` is as in `frequency_response`.  Modes are found by counting, so that none is missed.

        Raises SceneError for beams without an exact solution, springs between bodies, loads without
        a potential, and an unstable state.
        """
        return exact_modes(self, count, exact)

    @cached_property
    def findings(self) -> tuple[Risk, ...]:  # type: ignore[override]
        """Risks of the operating point and of effects that a linear model omits."""
        return tuple(find_linear_risks(self))

    def output_matrices(self, outputs: Sequence[str] | None = None) -> tuple[Array, Array]:
        """C (outputs, states) and D (outputs, inputs) of y = C z + D v.

        `outputs` are as in `frequency_response`.
        """
        return _output_matrices(self, outputs, self.input_channels, self.B)[1:]

    def to_control(self, outputs: Sequence[str] | None = None, disturbances: bool = False) -> Any:
        """Model as a `control.StateSpace` of python-control (extra control).

        Signals are named, with _ for each dot.  `disturbances` appends the disturbances to the
        inputs.  python-control provides discrete time, balanced and modal reduction, regulators and
        observers.

        Raises SceneError without inputs or for an unknown output, EnvironmentFailure without the
        extra.
        """
        return _to_control(self, outputs, disturbances)

    def plot(self, path: str | Path | None = None) -> Any:
        """Maps of M, C and K as a `matplotlib.figure.Figure`, written to `path` if given.

        Each coordinate has a row and a column; colours show sign and magnitude.

        Raises SceneError without coordinates, EnvironmentFailure without the extra `plot`.
        """
        from .plots.linear_plots import matrices

        return matrices(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Names, state, matrices, frame and risks as a dictionary for JSON."""
        from .file_formats import dictionary

        return dictionary(self) | {"frame": self.frame} | self.assessment()

    def save(self, path: str | Path) -> Path:
        """Save the matrices with row and column names: .nc (extra io) or .csv.

        The .csv file has one row per nonzero entry.

        Raises SceneError for another file extension, EnvironmentFailure without the extra.
        """
        from .file_formats import dataset, entries, save

        return save(path, lambda: dataset(self), entries(self))


# --- output matrices and python-control -----------------------------------------------------------


def _output_matrices(
    linear: StateSpace, outputs: Sequence[str] | None, pushes: Sequence[Channel], b: Array
) -> tuple[tuple[str, ...], Array, Array]:
    """Output names, C (outputs, states) and D (outputs, pushes) of y = C z + D v.

    `b` (states, pushes) is the input matrix of d/dt z.
    """
    named = None if outputs is None else some_names("outputs", outputs)
    shown = outputs_of(linear, named)
    check_steady_outputs(linear, shown)
    c, d = linear.state_output_matrices(rows_of(linear, shown, pushes), b)
    return tuple(quantity.name for quantity in shown), c, d


def _to_control(linear: StateSpace, outputs: Sequence[str] | None, disturbances: bool) -> Any:
    """Model as a `control.StateSpace`; see `Linear.to_control`."""
    try:
        import control
    except ImportError as error:
        raise missing_package_error("control", "a system for python-control", error) from None
    b, pushes = linear.B, linear.input_channels
    if disturbances:
        b, pushes = np.hstack([b, linear.B_disturbances]), (*pushes, *linear.disturbance_channels)
    if not pushes:
        raise SceneError(
            'the model has no inputs; give inputs, as in linearize(inputs=["shoulder.effort"])'
        )
    names, c, d = _output_matrices(linear, outputs, pushes, b)
    return control.ss(
        linear.A, b, c, d, states=list(map(_signal, linear.state_names)),
        inputs=[_signal(entry.name) for entry in pushes], outputs=list(map(_signal, names)),
    )  # fmt: skip


def _signal(name: str) -> str:
    """Signal name without dots, which separate system and signal names in python-control."""
    return name.replace(".", "_").replace("[", "_").replace("]", "")
