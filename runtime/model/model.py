"""Model: a compiled scene with all queries, simulations and linear analyses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array, batch, finite_float, integer, single_state
from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.display import NotebookDisplay, PublicMembers, table
from mstmm.errors import NumericalFailure
from mstmm.risk import Risk

from ..experiments.simulation import SimulatedScene
from ..integrate.methods import Method, to_method
from ..integrate.settings import Settings, to_output_times, validate
from .linear_analysis import LinearAnalysis

if TYPE_CHECKING:
    from ..engine.loops.branches import Branch
    from ..engine.loops.loop_analysis import LoopAnalysis
    from ..result.batch_result import BatchResult
    from ..run.batch_inputs import BatchInput
    from .assembly import Assembly
    from .equilibrium import Equilibrium
    from .session import Session


class Model(LinearAnalysis, SimulatedScene, PublicMembers, NotebookDisplay):
    """Compiled scene; created by `mstmm.compile`.

    `q` and `u` hold the hinges in the scene's order (`coordinate_layout`); SI units and radians;
    speeds and quaternions of ball and free hinges in outboard axes, quaternions w, x, y, z.

    Attributes:
        scene: the scene.
        sweep: sweep in use, "riccati", "refined", "qr" or "product".
    """

    member_groups: ClassVar[Mapping[str, str]] = {
        "Description": "scene nq nu coordinate_layout parameters loops flexible_bodies "
        "free_speed_indices simplifications engine engine_reason sweep",
        "States": "initial_state assemble assemble_path equilibrium integrate tangent_increments",
        "Dynamics": "accelerations solve mass_matrix bias_efforts gravity_efforts inverse_dynamics "
        "derivatives energy energy_components momentum",
        "Kinematics": "positions poses velocities jacobian jacobian_rate",
        "Simulation": "simulate simulate_batch session",
        "Linear analysis": "linearize modes dynamic_stiffness_modes frequency_response root_locus "
        "stability_limit waterfall unbalance_response",
        "Copies with other values": "with_inputs with_parameters",
    }

    def __repr__(self) -> str:
        return f"<Model: {self.scene.summary}, {self._mobility} degrees of freedom; {self.engine}>"

    def _repr_html_(self) -> str:
        rows = [("degrees of freedom", self._mobility), ("engine", self.engine_reason)]
        return table(rows) + self.scene._repr_html_()

    @property
    def _mobility(self) -> int:
        """Number of degrees of freedom: free speeds, less those that loops constrain."""
        return (
            len(self.free_speed_indices)
            if self.loop_start is None
            else self.loop_start.loops.mobility
        )

    @property
    def loops(self) -> LoopAnalysis:
        """Closed-loop analysis: cut hinges, constraint rows, redundant rows, mobility."""
        from ..engine.loops.loop_analysis import LoopAnalysis

        if self.loop_start is None:
            return LoopAnalysis()
        return replace(
            self.loop_start.loops,
            speed_choice=self._independent_speed_names,
            find_branches=self._find_branches,
        )

    def _find_branches(self) -> tuple[Branch, ...]:
        assert self.loop_start is not None
        return self.loop_start.branches

    def _independent_speed_names(self) -> tuple[str, ...]:
        assert self.independent_speeds is not None
        return tuple(
            self.coordinate_layout.u_name(place) for place in self.independent_speeds.indices
        )

    def assemble(
        self,
        q: ArrayLike | None = None,
        u: ArrayLike | None = None,
        hold: Sequence[str] = (),
        t: float = 0.0,
        branch: int | None = None,
    ) -> Assembly:
        """Nearest state (q, u) that satisfies all constraints at t (s).

        q (nq,) and u (nu,) are target values, by default those of the start.  Coordinates of the
        hinges named in `hold` keep their values, as do nonzero speeds of hinges, if these are not
        more than the mobility.  Driven coordinates and time-dependent couplings have their values
        at t.  Of the assembly branches found, the one nearest to q is used; on it the change is
        smallest in the norm of the inertia.  Without loops the state is returned unchanged.

        `branch` is the number of one of `loops.branches` to use instead: from its pose the held
        coordinates move to those in q in small steps, and all others in q are ignored.

        Raises SceneError for an unknown hinge or branch, for loops that do not close near the
        state, for a branch that ends before, and for speeds that contradict each other.
        """
        from .assembly import assemble

        initial, remedy = self.initial_state(), "assemble takes one state; see assemble_path"
        target_q = initial[0] if q is None else single_state("q", q, self.nq, remedy)
        target_u = initial[1] if u is None else single_state("u", u, self.nu, remedy)
        moving_hinges = (
            self.loop_start.fast_hinges if u is None and self.loop_start is not None else None
        )
        return assemble(
            self,
            target_q,
            target_u,
            hold,
            moving_hinges,
            finite_float("t", t, "a time in s"),
            branch,
        )

    def assemble_path(self, q: ArrayLike, hold: Sequence[str], branch: int = 0) -> Array:
        """Closed states (n, nq) on one branch along a path of held coordinates.

        The coordinates of the hinges named in `hold` are those in the rows of q (n, nq).  Each
        state is found from the one before in small steps, so that all are on the branch with
        number `branch` of `loops.branches`.

        Raises SceneError as `assemble` does; OpenLoop where the branch ends.
        """
        from .assembly import assemble_path

        rows = batch(("q", q, self.nq))[1][0]
        return assemble_path(self, rows, hold, branch)

    def check_start_determined(self) -> None:
        """Raise SceneError, naming the hinges, if motions at the start have no inertia."""
        from .assembly import check_start_determined

        check_start_determined(self, *self.initial_state())

    def check_outputs(self) -> None:
        """Raise SceneError for outputs and controller measurements that results do not have."""
        if self.scene.output or self.scene.controller:
            from ..result.quantity_names import quantity_of

            start = self.simulate(0.0, "dop853")
            for output in self.scene.output:
                quantity_of(output, start.t, start.quantity)

    def equilibrium(
        self,
        q: ArrayLike | None = None,
        t: float = 0.0,
        tolerance: float = 1e-10,
        *,
        max_steps: int = 2000,
        progress: Callable[[int, float], None] | None = None,
    ) -> Equilibrium:
        """Static equilibrium (nq,): q of zero acceleration at rest, near `q` or the start.

        `tolerance` is the largest error of coordinates: rad, or relative to the length of the parts
        that they move.  The returned array has `residuals`, the remaining efforts by the names of
        speeds, and `unstable`, the speeds with which the motion leaves a saddle.  Descent steps
        turn into Newton steps, O(bodies) each, with closed loops too.  `max_steps` limits their
        number; `progress` is called with the number and the length of each, in rad or relative to
        lengths.
        Hinges whose number of turns has no effect end within half a turn of the start.

        Drives and loads have their values at t (s).  Where drives move at t, the result is the rest
        relative to them, which has to last: no effort may be missing while they move on.
        `warnings` tells where loads or drives change only later.

        Raises NumericalFailure naming the undetermined coordinates; with the remaining efforts, if
        there is no equilibrium near the start, or none at all; and where moving drives do not keep
        the state at rest.
        """
        from .equilibrium import equilibrium, with_persistence_findings

        remedy = "call equilibrium for each of several"
        start = self.initial_state()[0] if q is None else single_state("q", q, self.nq, remedy)
        t, tolerance = finite_float("t", t, "a time in s"), finite_float("tolerance", tolerance)
        step_limit = integer("max_steps", max_steps, 1, "a number of steps from 1 on")
        state = equilibrium(self, start, t, tolerance, step_limit, progress)
        linearise = partial(self.linearize, np.asarray(state), None, t, inputs=(), disturbances=())
        return with_persistence_findings(self, state, t, linearise)

    def session(
        self,
        q: ArrayLike | None = None,
        u: ArrayLike | None = None,
        t: float = 0.0,
        method: str | Method = METHOD,
        step: float | None = None,
        rtol: float = RTOL,
        atol: float = ATOL,
    ) -> Session:
        """Start a run that the caller advances: `session.advance(dt, inputs={...})`.

        From q (nq,) and u (nu,), by default the start of the scene, at t (s).  method, step, rtol
        and atol as in `simulate`, except the methods auto, of SciPy, of SUNDIALS and the classical
        ones, which only make whole runs.  A fixed step is checked once per model and step;
        objections are in `warnings` of every such session.

        Raises SceneError for invalid settings or an invalid state.
        """
        from .session import Session

        t_start = finite_float("t", t, "a time in s")
        chosen = to_method(method)
        settings = validate(
            Settings(
                t_start, t_start, chosen.name or METHOD, step, rtol, atol, (), **chosen.options
            )
        )
        start, remedy = self.initial_state(), "make a session for each of several"
        state = (
            start[0] if q is None else single_state("q", q, self.nq, remedy),
            start[1] if u is None else single_state("u", u, self.nu, remedy),
        )
        return Session(self, settings, *state, self._step_risks(settings, *state))

    def _step_risks(self, settings: Settings, q: Array, u: Array) -> tuple[Risk, ...]:
        """Objections to a fixed step, checked once at the first state of a session with it."""
        if settings.step is None:
            return ()
        key = settings.method, settings.step, settings.radius
        if key not in self._step_risk_cache:
            from .session import step_risks

            self._step_risk_cache[key] = step_risks(self, settings, q, u)
        return self._step_risk_cache[key]

    @cached_property
    def _step_risk_cache(self) -> dict[tuple[str, float, float | None], tuple[Risk, ...]]:
        return {}

    def simulate_batch(
        self,
        initial_states: tuple[ArrayLike, ArrayLike],
        parameters: Mapping[str, ArrayLike] | None = None,
        *,
        t_end: float,
        inputs: Mapping[str, BatchInput] | None = None,
        output_times: ArrayLike | Sequence[float] | None = None,
        method: str | Method = METHOD,
        step: float | None = None,
        rtol: float = RTOL,
        atol: float = ATOL,
        t_start: float = 0.0,
        threads: int | None = None,
    ) -> BatchResult:
        """Simulate n independent trajectories to `t_end` (s).

        Args:
            initial_states: q (n, nq) and u (n, nu); a single row is used for all.
            parameters: numbers by name (as in `with_parameters`), (n,) or one for all.
            inputs: inputs of the scene by name: as in `simulate`, and numbers (n,), or (times,
                values) and the keys of a [[signal]] with values (n, m).
            output_times: times of the samples (s, increasing); otherwise `t_end` alone.
            threads: by default the number of processors.
            method, step, rtol, atol, t_start: as in `simulate`; the method auto chooses for each
                trajectory.

        Trajectories run on several threads, and in vector lanes with explicit methods if the scene
        has no events, releases, twist springs and drives.  Each trajectory is bit for bit
        independent of the others, of the size of the batch and of the threads.  A failed trajectory
        has `success` False, a message, and nan after the failure.

        Raises SceneError for invalid settings, shapes or parameters.
        """
        from ..result.batch_result import BatchResult
        from ..run.batch_run import prepare_batch, simulate_batch

        chosen, times = to_method(method), to_output_times(output_times)
        settings = Settings(
            t_end, t_start, chosen.name or METHOD, step, rtol, atol, times, **chosen.options
        )
        settings, q, u = prepare_batch(self, settings, initial_states)
        run = simulate_batch(
            self, settings, q, u, {} if parameters is None else parameters, inputs, threads
        )
        return BatchResult(**vars(run))


__all__ = ["Model", "NumericalFailure"]
