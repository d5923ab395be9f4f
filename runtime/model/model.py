"""Model: a compiled scene with all queries, simulations and linear analyses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from mstmm.argument_validation import require_bool
from mstmm.array_validation import Array, batch, finite_float, integer, single_state, split_state
from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.display import NotebookDisplay, PublicMembers, table
from mstmm.errors import NumericalFailure
from mstmm.risk import Risk

from ..engine.inputs import InputValue
from ..integrate.methods import Method, to_method
from ..integrate.settings import Settings, to_output_times, validate
from .execution import Execution, check_execution
from .linear_analysis import LinearAnalysis

if TYPE_CHECKING:
    from ..engine.loops.branches import Branch
    from ..engine.loops.loop_analysis import LoopAnalysis
    from ..result.batch_result import BatchResult
    from ..result.result import Result
    from ..run.batch.batch_inputs import BatchInput
    from .assembly import Assembly
    from .equilibrium import Equilibrium
    from .session import Session
    from .target_error.error_request import ErrorRequest


class Model(LinearAnalysis, PublicMembers, NotebookDisplay):
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

    def initial_state(self) -> tuple[Array, Array]:
        """Initial state (q, u) of the scene at t = 0, with driven coordinates."""
        q, u = self._initial_state
        return q.copy(), u.copy()

    @cached_property
    def _initial_state(self) -> tuple[Array, Array]:
        """Cached result of `initial_state`."""
        from ..run.start_state import initial_state

        return initial_state(self)

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
        from .undetermined_start import check_start_determined

        check_start_determined(self, *self.initial_state())

    def check_outputs(self) -> None:
        """Raise SceneError for outputs and controller measurements that results do not have."""
        if self.scene.output or self.scene.controller:
            from ..result.scene_outputs import quantity_of

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
        from .equilibrium import equilibrium
        from .equilibrium_persistence import with_persistence_findings

        remedy = "call equilibrium for each of several"
        start = self.initial_state()[0] if q is None else single_state("q", q, self.nq, remedy)
        t, tolerance = finite_float("t", t, "a time in s"), finite_float("tolerance", tolerance)
        step_limit = integer("max_steps", max_steps, 1, "a number of steps from 1 on")
        state = equilibrium(self, start, t, tolerance, step_limit, progress)
        linearise = partial(self.linearize, np.asarray(state), None, t, inputs=(), disturbances=())
        return with_persistence_findings(self, state, t, linearise)

    def simulate(
        self,
        t_end: float,
        method: str | Method | None = None,
        step: float | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        output_times: ArrayLike | Sequence[float] | None = None,
        *,
        initial: tuple[ArrayLike, ArrayLike] | None = None,
        inputs: Mapping[str, InputValue] | None = None,
        error: float | ErrorRequest | None = None,
        certify: bool = False,
        t_start: float = 0.0,
        execution: Execution | None = None,
    ) -> Result:
        """Simulate to `t_end` (s).

        Args:
            method: name of a method, or an object of `mstmm.methods` with options of its own.
                rk4 (with `step`), dopri5, dop853, pirk13 (order 13, for smooth motions on fused
                code); auto, which is dop853 until stability sets its steps, then rodas4p2 (rtol
                from 1e-5 on) or rodas5p, and back; for stiff motion rodas4p2, rodas5p, rodas4,
                ros34pw2, rodas4pw, esdirk436, kvaerno5, genalpha, dttmm, hht, newmark, wilson or
                houbolt; genalpha-index3 and hht-index3, which close loops by positions; exprb32 for
                undamped vibration of few unknowns; scipy-DOP853, scipy-RK45, scipy-Radau,
                scipy-BDF, scipy-LSODA, sundials-BDF, sundials-Adams: integrators of SciPy and
                SUNDIALS on the same kernels; dttmm-classical, dttmm-classical-product (with
                `step`): the discrete-time transfer matrix method in absolute coordinates.
                Without one auto, or dop853 where `step` is given; a run that has kept to dop853
                is recorded as one by that method.
            step: fixed step in s; otherwise `rtol` (1e-9) and `atol` (1e-12) control the step.
            output_times: times of the samples (s, increasing), a lone whole number excepted;
                otherwise every accepted step (with an error 201 samples).
            initial: (q, u) instead of the initial state of the scene.
            inputs: inputs of the scene in this run by name, as in `with_inputs`: numbers, names of
                signals, (times, values), or the keys of a [[signal]].
            error: target error of the whole run, instead of tolerances: in rad, and of other
                coordinates relative to the largest excursion of their unit; of other quantities as
                an `ErrorRequest`.  Several runs find the tolerance; `Result.achieved_error` is the
                error.
            certify: estimate the error by a second, more accurate run.
            t_start: start time in s for drives, loads and signals.
            execution: reaction to risks, progress calls, checkpoint and resumption.

        Returns a Result, also after a failure: `success`, `message` and everything computed so far.
        Raises SceneError for invalid settings, RiskRefused with on_risk = "refuse".
        """
        from ..risk_checks.risk_policy import apply_policy, check_start
        from .run_results import simulate
        from .target_error.error_request import Control, parse_error_request

        run = check_execution(execution)
        model = self if inputs is None else self.with_inputs(inputs)
        certify, resume = require_bool("certify", certify), run.resume
        chosen = None if method is None else to_method(method)
        given = Control(None if chosen is None else chosen.name or None, step, rtol, atol)
        request = parse_error_request(error, given, run.checkpoint is not None or resume)
        name, rtol, atol = given.with_defaults()
        settings = validate(
            Settings(
                t_end, t_start, name, step, rtol, atol, to_output_times(output_times),
                **({} if chosen is None else chosen.options),
            )
        )  # fmt: skip
        q, u = model.initial_state() if initial is None else split_state("initial", initial)
        remedy = "simulate_batch takes many"
        q, u = (
            single_state("initial q", q, self.nq, remedy),
            single_state("initial u", u, self.nu, remedy),
        )
        seen = check_start(model, settings, q, u, run.on_risk)
        if request is not None:
            from .target_error import tolerance_search

            result = tolerance_search.simulate(
                model, settings, request, q, u, seen=seen, certify=certify, progress=run.progress
            )
        else:
            result = simulate(
                model, settings, q, u, seen=seen, certify=certify, progress=run.progress,
                checkpoint=run.checkpoint, resume=resume, named=given.method is not None,
            )  # fmt: skip
        return apply_policy(result, run.on_risk)

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
        from ..run.batch.batch_run import prepare_batch, simulate_batch

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
