"""Linear: a scene made linear about a state, and what follows from that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.argument_validation import abbreviate
from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.risk import Risk

from ..packing.coordinate_layout import check_dense_size
from .frequency_response import FrequencyResponse, frequency_response
from .harmonic.dynamic_stiffness_modes import DynamicStiffnessModes, exact_modes
from .harmonic.exact_beams import Chosen
from .harmonic.hysteretic_damping import Losses
from .harmonic.modal_damping import Ratios
from .mode_solvers import modes
from .modes import Modes
from .rotors.fixed_frame import carrying_at, frame_of
from .state_space import StateSpace
from .validity import find_linear_risks


class Linear(StateSpace):
    """Linear equations of motion with their natural motions; see `Equations`."""

    def modes(self, count: int | None = None, damped: bool | None = None) -> Modes:
        """Natural motions: all, or the `count` slowest ones; with C where there is any, `damped`
        False leaves it out.

        Few of many come by shift and invert over the O(bodies) solution.  Of undamped ones the
        pivots of the sweep count how many there are, so that none is missed.

        Raises SceneError for a count that makes no sense, NumericalFailure where a motion moves no
        inertia or the iteration does not converge.
        """
        if damped is not None and not isinstance(damped, bool | np.bool_):
            raise SceneError(f"damped = {abbreviate(damped)}: expected True, False or None")
        self.check_count(count, len(self))
        if count is None:
            check_dense_size(len(self), "the matrix of all motions")
        return modes(self, count, damped)

    @cached_property
    def frame(self) -> str:
        """Frame of x and of all frequencies: "rotating" where coordinates turn along with bodies
        that spin at the state, so that frequencies are those that the rotor sees; else "fixed"."""
        return frame_of(self)

    def to_fixed_frame(self) -> Linear:
        """The same model in the fixed frame: increments of an axisymmetric rotor as they are in
        axes that do not turn, those of its supports as they were; exact.  Coordinates keep their
        names; those of three or more equal blades are the pattern of the rotor at the azimuths
        where the blades are now (multi-blade coordinates).  Pushes and
        outputs are those at the ends of bodies in inertial axes.

        Raises SceneError where a rotor is neither axisymmetric nor one of equal blades, or its
        coefficients change as it turns.
        """
        if self.frame == "fixed":
            return self
        return replace(self, carrying=carrying_at(self))

    @staticmethod
    def check_count(count: int | None, most: int) -> None:
        """Raises SceneError for a number of motions that is none from 1 to `most`."""
        if count is None:
            return
        if not isinstance(count, (int, np.integer)):
            raise SceneError(f"count = {count!r}: expected a whole number of motions")
        if not most:
            raise SceneError(f"count = {count!r}: nothing moves in this scene")
        if isinstance(count, bool) or not 0 < count <= most:
            raise SceneError(f"count = {count!r}: expected a number of motions from 1 to {most}")

    def frequency_response(
        self,
        omega: ArrayLike,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        *,
        structural: Losses = 0.0,
        modal: Ratios = 0.0,
        exact: Chosen = False,
    ) -> FrequencyResponse:
        """Amplitudes of outputs under harmonic inputs at angular frequencies omega (k,) in rad/s,
        O(bodies) a frequency.

        `inputs` are names as of `Model.linearize`: those of v where none are named, of w where
        there are no v.  `outputs` are coordinates ("shoulder.angle"), their rates
        ("shoulder.angle_rate"), motions of bodies and ends in inertial axes ("boom.tip.position.y",
        "boom.tip.vy", "boom.tip.angular_velocity.z"), "strut.length" and "strut.effort" of springs,
        and outputs of the scene, expressions too; beside the state and, under accelerations of the
        ground, relative to it.  Where none are named they are the outputs of the scene, or all
        coordinates.

        Two kinds of damping join what the scene has.  `structural` are loss factors eta: stiffness
        k of laws, springs and shapes becomes k (1 + i eta), of all of them or by the names of
        hinges, chains, flexible bodies and springs; what expressions give loses nothing.  `modal`
        are parts of the critical damping: of all natural motions of the undamped scene (from their
        matrices), or of as many of the slowest as there are numbers (O(bodies) each), the others
        staying as they are.

        `exact`, True for all or a list of names, gives uniform beams their exact dynamic stiffness
        in the directions in which they have shapes, in place of these: bending after Euler and
        Bernoulli, twist, tension, at any frequency.

        Raises SceneError for a name or frequency that does not fit, NumericalFailure at a resonance
        without damping.
        """
        return frequency_response(self, omega, inputs, outputs, structural, modal, exact)

    def exact_modes(self, count: int, exact: Chosen = True) -> DynamicStiffnessModes:
        """The `count` slowest undamped natural motions with exact beams (`exact` as in
        `frequency_response`), found by counting: none is missed, however many there are.

        Raises SceneError for beams that the exact solution does not hold for, springs between
        bodies, loads without potential and a state from which a motion grows.
        """
        return exact_modes(self, count, exact)

    @cached_property
    def findings(self) -> tuple[Risk, ...]:  # type: ignore[override]
        """Risks of the state, and of what a linear model leaves out."""
        return tuple(find_linear_risks(self))

    def output_matrices(self, outputs: Sequence[str] | None = None) -> tuple[Array, Array]:
        """C (outputs, states) and D (outputs, inputs) of y = C z + D v; `outputs` as
        `frequency_response` takes them."""
        from .python_control import output_matrices

        return output_matrices(self, outputs, self.controls, self.B)[1:]

    def to_control(self, outputs: Sequence[str] | None = None, disturbances: bool = False) -> Any:
        """`control.StateSpace` of python-control (extra control), its signals named, with _ for
        every dot; `disturbances` are inputs behind the others.  Discrete time, reduction by
        balancing or modes, regulators and observers are that library's.

        Raises SceneError where there is no input or an output is unknown, EnvironmentFailure
        without the extra.
        """
        from .python_control import to_control

        return to_control(self, outputs, disturbances)

    def plot(self, path: str | Path | None = None) -> Any:
        """`matplotlib.figure.Figure`: M, C and K as maps, a row and a column for each coordinate,
        colours by sign and size; written to `path` where it is given.

        Raises SceneError where nothing moves, EnvironmentFailure without the extra `plot`.
        """
        from .plots.matrices import matrices

        return matrices(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Names, state, matrices and risks, for JSON."""
        from .file_formats import dictionary

        return dictionary(self) | {"frame": self.frame} | self.assessment()

    def save(self, path: str | Path) -> Path:
        """Matrices by the names of their rows and columns: .nc (extra io), or .csv with a row for
        every entry that is not zero.

        Raises SceneError for another ending, EnvironmentFailure without the extra.
        """
        from .file_formats import dataset, entries, save

        return save(path, lambda: dataset(self), entries(self))
