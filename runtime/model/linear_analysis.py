"""What a model answers as a linear one: motions, responses, and where they become unstable."""

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
    from ..linear.harmonic.dynamic_stiffness_modes import DynamicStiffnessModes
    from ..linear.harmonic.exact_beams import Chosen
    from ..linear.harmonic.hysteretic_damping import Losses
    from ..linear.harmonic.modal_damping import Ratios
    from ..linear.linear_model import Linear
    from ..linear.modes import Modes
    from ..linear.operating_point.friction import Amplitudes
    from ..linear.root_locus import RootLocus, StabilityLimit
    from ..linear.rotors.unbalance import UnbalanceResponse
    from ..linear.waterfall import Waterfall
    from .linearisation import Lineariser


class LinearAnalysis(DynamicsQueries):
    """A compiled scene that is asked for small motions; see `Model`."""

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
        """M x'' + C x' + K x = V v + W w near a state: at rest where nothing is given, else near
        `q` (nq,) and `u` (nu,; 0, or the scene's start q where only u is given) at time t (s).

        `inputs` name v and `disturbances` w: efforts of hinges and springs ("shoulder.effort"),
        forces and moments at ends in inertial axes ("boom.tip.force.x", "boom.tip.mz"),
        accelerations of the ground ("ground.acceleration.y"; all three are w where nothing is
        named), inputs of the scene that nothing is driven by (all are v where nothing is named).
        Coordinates that a drive imposes are left out; the others move along with it.  Exact, no
        differences.  Beside a motion with rolling contacts or rows of speeds it is a
        `NonholonomicLinear`, which has A and B but no M, C and K.

        Dry friction of hinges that rest at the state is left out, and `Linear.warnings` has the
        amplitude below which they stick.  `friction` gives amplitudes V of speed (rad/s or m/s),
        one or by the names of hinges, chains or speeds, at which it counts as the viscous damping
        of equal work, 4 F/(pi V) of Coulomb's.  Of hinges that slide it has its own slope.

        Raises SceneError for a name or shape that does not fit, NumericalFailure where there is no
        equilibrium near the scene's start or the state has no accelerations.
        """
        instead = "call linearize for each of several"
        return self._linearising(
            None if q is None else single_state("q", q, self.nq, instead),
            None if u is None else single_state("u", u, self.nu, instead),
            finite_float("t", t, "a time in s"), inputs, disturbances, friction,
        )  # fmt: skip

    @cached_property
    def _linearising(self) -> Lineariser:
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
        """Natural motions near a state, as `linearize` takes it: all, or the `count` slowest.

        With damping and gyroscopic loads where there are any; `damped` False leaves them out.  See
        `Linear.modes`, and `linearize` for `friction`.
        """
        return self.linearize(q, u, t, friction=friction).modes(count, damped)

    def exact_modes(
        self,
        count: int,
        exact: Chosen = True,
        q: ArrayLike | None = None,
        t: float = 0.0,
    ) -> DynamicStiffnessModes:
        """The `count` slowest undamped natural motions at rest, which exact beams hold for alone,
        all of these or those named.  See `Linear.exact_modes`."""
        return self.linearize(q, None, t).exact_modes(count, exact)

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
        exact: Chosen = False,
        friction: Amplitudes = None,
        u: ArrayLike | None = None,
    ) -> FrequencyResponse:
        """Amplitudes of outputs under harmonic inputs at omega (k,) in rad/s, near a state `q`,
        `u` as `linearize` takes it.  See `Linear.frequency_response`, and `linearize` for
        `friction`; without `inputs` those of the scene push, else the ground moves."""
        return self.linearize(q, u, t, friction=friction).frequency_response(
            omega, inputs, outputs, structural=structural, modal=modal, exact=exact
        )

    def locus(
        self,
        parameter: str,
        values: ArrayLike,
        count: int | None = None,
        *,
        damped: bool | None = None,
        friction: Amplitudes = None,
        frame: str = "auto",
    ) -> RootLocus:
        """Natural motions at rest over a number of the scene, named as in `with_parameters`: its
        root locus, or Campbell's diagram where it is a spin ("constants.spin" in a drive);
        `friction` as in `linearize`.

        `frame` of the frequencies: "auto" is the fixed frame where all rotors are axisymmetric,
        else the rotating one of their coordinates, with a warning; "fixed" and "rotating" are
        these by name.

        Raises SceneError for an unknown name, values (m,) that make no sense and rotors without a
        fixed frame, NumericalFailure where there is no equilibrium.
        """
        from ..linear.root_locus import trace_modes

        points = one_row("values", values)
        at = self._linear_at(parameter, friction)
        return trace_modes(at, parameter, points, count, damped, frame)

    def waterfall(
        self, parameter: str, values: ArrayLike, omega: ArrayLike, input: str, output: str
    ) -> Waterfall:
        """`frequency_response` of one output under one input over a number of the scene too."""
        from ..linear.waterfall import waterfall

        points = one_row("values", values)
        return waterfall(self._linear_at(parameter), parameter, points, omega, (input, output))

    def unbalance_response(
        self,
        parameter: str,
        values: ArrayLike,
        at: str,
        unbalance: float,
        points: Sequence[str] | None = None,
    ) -> UnbalanceResponse:
        """Whirl of `points`, bodies or ends, under an unbalance m e (kg m) that turns with the body
        of the end `at`, over a number of the scene that sets its spin ("constants.spin" in a
        drive); of `at` itself unless points are given.

        Steady and linear about the equilibrium, in the fixed frame, at the frequency of the spin.
        Raises SceneError for unknown names and rotors that are not axisymmetric,
        NumericalFailure at a critical speed without damping.
        """
        from ..linear.rotors.unbalance import unbalance_response

        found = [at] if points is None else some_names("points", points)
        speeds = one_row("values", values)
        return unbalance_response(
            self._linear_at(parameter, inputs=()), parameter, speeds, at, unbalance, found
        )

    def critical(
        self, parameter: str, stable: float, unstable: float, *, friction: Amplitudes = None
    ) -> StabilityLimit:
        """Where between two values of a number of the scene a motion near rest begins to grow: the
        buckling load, the speed of flutter.  By bisection; of several places one is found;
        `friction` as in `linearize`.

        Raises SceneError for an unknown name, or ends that are not stable and unstable.
        """
        from ..linear.root_locus import critical

        ends = finite_float("stable", stable), finite_float("unstable", unstable)
        return critical(self._linear_at(parameter, friction), parameter, *ends)

    def _linear_at(
        self, parameter: str, friction: Amplitudes = None, inputs: Sequence[str] | None = None
    ) -> Callable[[float], Linear]:
        return lambda value: self.with_parameters({parameter: value}).linearize(
            inputs=inputs, disturbances=(), friction=friction
        )
