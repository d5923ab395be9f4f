"""Linear analyses of a model: modes, frequency responses and stability limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from mstmm.array_validation import finite_float, one_row, single_state

from ..linear.input_channels import some_names
from .state_dynamics import DynamicsQueries

if TYPE_CHECKING:
    from ..linear.frequency_response import FrequencyResponse
    from ..linear.harmonic.damping import Losses, Ratios
    from ..linear.harmonic.dynamic_stiffness_modes import DynamicStiffnessModes
    from ..linear.harmonic.exact_beams import BeamSelection
    from ..linear.linear_model import Linear
    from ..linear.modes import Modes
    from ..linear.operating_point.friction import Amplitudes
    from ..linear.parameter_sweeps import UnbalanceResponse, Waterfall
    from ..linear.root_locus import RootLocus, StabilityLimit
    from .linearisation import Lineariser


class LinearAnalysis(DynamicsQueries):
    """Compiled scene with linear analyses; see `Model`."""

    def linearize(
        self,
        q: ArrayLike | None = None,
        u: ArrayLike | None = None,
        t: float = 0.0,
        *,
        inputs: Sequence[str] | None = None,
        disturbances: Sequence[str] | None = None,
        friction: Amplitudes = None,
    ) -> Linear:
        """Linear model M x'' + C x' + K x = V v + W w about an operating point.

        By default about the equilibrium; else about `q` (nq,) and `u` (nu,; default 0) at time t
        (s), with q of the scene's start if only u is given.

        `inputs` name v and `disturbances` w: efforts of hinges and springs ("shoulder.effort"),
        forces and moments at ends in inertial axes ("boom.tip.force.x", "boom.tip.mz"),
        accelerations of the ground ("ground.acceleration.y"; by default all three are w), inputs of
        the scene that drive no coordinate (by default all are v).  Driven coordinates are left out;
        the others move relative to the drives.  The derivatives are exact.  About a motion with
        rolling contacts or velocity constraints the result is a `NonholonomicLinear`, which has A
        and B but no M, C and K.

        Dry friction of hinges at rest is left out, and `Linear.warnings` has the amplitude below
        which they stick.  `friction` gives amplitudes V of speed (rad/s or m/s), one or by the
        names of hinges, chains or speeds, at which friction is replaced by viscous damping of equal
        work, 4 F/(pi V) for Coulomb friction.  Sliding hinges have the slope of their friction law.

        Raises SceneError for an unknown name or a wrong shape, NumericalFailure if there is no
        equilibrium near the start of the scene or the state has no accelerations.
        """
        remedy = "call linearize for each of several"
        return self._lineariser(
            None if q is None else single_state("q", q, self.nq, remedy),
            None if u is None else single_state("u", u, self.nu, remedy),
            finite_float("t", t, "a time in s"), inputs, disturbances, friction,
        )  # fmt: skip

    @cached_property
    def _lineariser(self) -> Lineariser:
        from .linearisation import Lineariser

        return Lineariser(self)

    def modes(
        self,
        count: int | None = None,
        q: ArrayLike | None = None,
        u: ArrayLike | None = None,
        t: float = 0.0,
        *,
        damped: bool | None = None,
        friction: Amplitudes = None,
    ) -> Modes:
        """Normal modes about an operating point: all, or the `count` slowest.

        Operating point and `friction` as in `linearize`.  With damping and gyroscopic loads, unless
        `damped` is False.  See `Linear.modes`.
        """
        return self.linearize(q, u, t, friction=friction).modes(count, damped)

    def dynamic_stiffness_modes(
        self, count: int, exact: BeamSelection = True, q: ArrayLike | None = None, t: float = 0.0
    ) -> DynamicStiffnessModes:
        """The `count` slowest undamped modes at rest, with the dynamic stiffness of beams.

        `exact` True for all beams, or the names of some.  See `Linear.exact_modes`.
        """
        return self.linearize(q, None, t).dynamic_stiffness_modes(count, exact)

    def frequency_response(
        self,
        omega: ArrayLike,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        q: ArrayLike | None = None,
        t: float = 0.0,
        *,
        structural: Losses = 0.0,
        modal: Ratios = 0.0,
        exact: BeamSelection = False,
        friction: Amplitudes = None,
        u: ArrayLike | None = None,
    ) -> FrequencyResponse:
        """Frequency response at omega (k,) in rad/s about an operating point.

        Operating point `q`, `u` and `friction` as in `linearize`; default inputs are those of the
        scene, or accelerations of the ground without any.  See `Linear.frequency_response`.
        """
        return self.linearize(q, u, t, friction=friction).frequency_response(
            omega, inputs, outputs, structural=structural, modal=modal, exact=exact
        )

    def root_locus(
        self,
        parameter: str,
        values: ArrayLike,
        count: int | None = None,
        *,
        damped: bool | None = None,
        friction: Amplitudes = None,
        frame: str = "auto",
    ) -> RootLocus:
        """Root locus of the modes at rest over a parameter, or Campbell diagram over a spin.

        `parameter` is named as in `with_parameters`; a spin is one such as "constants.spin" in a
        drive.  `friction` as in `linearize`.  `frame` of the frequencies: "auto" is the fixed frame
        if all rotors are axisymmetric, else the rotating one of their coordinates, with a warning;
        "fixed" and "rotating" select one.

        Raises SceneError for an unknown name, invalid values (m,) and rotors without a fixed frame,
        NumericalFailure if there is no equilibrium.
        """
        from ..linear.root_locus import trace_modes

        points = one_row("values", values)
        model_at = self._linear_model_at(parameter, friction)
        return trace_modes(model_at, parameter, points, count, damped, frame)

    def waterfall(
        self, parameter: str, values: ArrayLike, omega: ArrayLike, input: str, output: str
    ) -> Waterfall:
        """Frequency response of one output to one input over a parameter and omega (rad/s)."""
        from ..linear.parameter_sweeps import waterfall

        points = one_row("values", values)
        model_at = self._linear_model_at(parameter)
        return waterfall(model_at, parameter, points, omega, (input, output))

    def unbalance_response(
        self,
        parameter: str,
        values: ArrayLike,
        at: str,
        unbalance: float,
        points: Sequence[str] | None = None,
    ) -> UnbalanceResponse:
        """Whirl of `points` due to an unbalance m e (kg m) at the end `at`, over a spin.

        `points` are bodies or ends, by default `at`.  The unbalance rotates with the body of `at`;
        `parameter` sets its spin, such as "constants.spin" in a drive.  The response is steady and
        linear about the equilibrium, in the fixed frame, at the frequency of the spin.  Raises
        SceneError for unknown names and rotors that are not axisymmetric, NumericalFailure at a
        critical speed without damping.
        """
        from ..linear.parameter_sweeps import unbalance_response

        observed = [at] if points is None else some_names("points", points)
        speeds = one_row("values", values)
        return unbalance_response(
            self._linear_model_at(parameter, inputs=()), parameter, speeds, at, unbalance, observed
        )

    def stability_limit(
        self, parameter: str, stable: float, unstable: float, *, friction: Amplitudes = None
    ) -> StabilityLimit:
        """Parameter value at the stability limit, such as a buckling load or flutter speed.

        By bisection between a `stable` and an `unstable` value; finds one of several limits.
        `friction` as in `linearize`.

        Raises SceneError for an unknown name, or ends that are not stable and unstable.
        """
        from ..linear.root_locus import critical

        ends = finite_float("stable", stable), finite_float("unstable", unstable)
        return critical(self._linear_model_at(parameter, friction), parameter, *ends)

    def _linear_model_at(
        self, parameter: str, friction: Amplitudes = None, inputs: Sequence[str] | None = None
    ) -> Callable[[float], Linear]:
        return lambda value: self.with_parameters({parameter: value}).linearize(
            inputs=inputs, disturbances=(), friction=friction
        )
