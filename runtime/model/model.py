"""Model: a compiled scene, and everything that can be asked of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mstmm.argument_validation import require_bool
from mstmm.array_validation import Array, batch, finite_float, integer, single_state, split_state
from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import NumericalFailure
from mstmm.notebook_html import NotebookDisplay, table
from mstmm.risk import Risk

from ..engine.input_values import InputValue
from ..integrate.settings import Settings, to_output_times, validate
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


class Model(LinearAnalysis, NotebookDisplay):
    """A scene ready to compute.  Made by `mstmm.compile`.

    `q` and `u` hold the hinges in the scene's order (`layout`); SI units and radians; speeds and
    quaternions of ball and free hinges in outboard axes, quaternions w, x, y, z.
    """

    def __repr__(self) -> str:
        return f"<Model: {self.scene.summary}, {self._freedom} degrees of freedom; {self.engine}>"

    def _repr_html_(self) -> str:
        rows = [("degrees of freedom", self._freedom), ("engine", self.engine_choice)]
        return table(rows) + self.scene._repr_html_()

    @property
    def _freedom(self) -> int:
        """How many speeds are free, of those that loops leave."""
        return len(self.free_speeds) if self.closed is None else self.closed.loops.mobility

    def initial_state(self) -> tuple[Array, Array]:
        """(q, u) at t = 0 as the scene gives them, driven coordinates included."""
        q, u = self._start
        return q.copy(), u.copy()

    @cached_property
    def _start(self) -> tuple[Array, Array]:
        """What `initial_state` gives, computed once: a scene does not change."""
        from ..run.start_state import initial_state

        return initial_state(self)

    @property
    def loops(self) -> LoopAnalysis:
        """What closes in the scene: cut hinges, rows and those that repeat others, mobility."""
        from ..engine.loops.loop_analysis import LoopAnalysis

        if self.closed is None:
            return LoopAnalysis()
        return replace(self.closed.loops, decided_by=self._independent, found_by=self._branches)

    def _branches(self) -> tuple[Branch, ...]:
        assert self.closed is not None
        return self.closed.branches

    def _independent(self) -> tuple[str, ...]:
        assert self.freedom is not None
        return tuple(self.layout.u_name(place) for place in self.freedom.places)

    def assemble(
        self,
        q: ArrayLike | None = None,
        u: ArrayLike | None = None,
        hold: Sequence[str] = (),
        t: float = 0.0,
        branch: int | None = None,
    ) -> Assembly:
        """The nearest (q, u) at which all loops are closed at t (s), near the start where nothing
        is given.

        q (nq,) and u (nu,) are wishes, but for the coordinates of the hinges named in `hold`, and
        for the speeds of hinges that have some, which stay what they are where these are no more
        than the mechanism has freedoms; driven coordinates and couplings that go by time are those
        at t.  Of the ways in which the loops can close that which is nearest to q is taken, of
        those that are found; on it what changes changes least, by inertia.  Without loops the state
        itself.

        `branch` is the number of one of `loops.branches` to be on instead: from its pose the held
        coordinates are led to those in q by small steps, and nothing else in q counts.

        Raises SceneError for a hinge or branch that there is not, for loops that do not close near
        the state, for a branch that ends before, and for speeds that contradict each other.
        """
        from .assembly import assemble

        start, only = self.initial_state(), "assemble takes one state; see assemble_path"
        wish_q = start[0] if q is None else single_state("q", q, self.nq, only)
        wish_u = start[1] if u is None else single_state("u", u, self.nu, only)
        fast = self.closed.fast if u is None and self.closed is not None else None
        return assemble(
            self, wish_q, wish_u, hold, fast, finite_float("t", t, "a time in s"), branch
        )

    def assemble_path(self, q: ArrayLike, hold: Sequence[str], branch: int = 0) -> Array:
        """Closed states (n, nq) with the coordinates of the hinges named in `hold` as in the rows
        of q (n, nq), each found from the one before by small steps, so that they lie on one branch:
        number `branch` of `loops.branches`.

        Raises SceneError as `assemble` does; OpenLoop where the branch ends.
        """
        from .assembly import assemble_path

        rows = batch(("q", q, self.nq))[1][0]
        return assemble_path(self, rows, hold, branch)

    def refuse_undetermined_start(self) -> None:
        """SceneError naming the hinges if the masses leave a motion of the start undetermined."""
        from .undetermined_start import refuse_undetermined_start

        refuse_undetermined_start(self, *self.initial_state())

    def refuse_unknown_outputs(self) -> None:
        """SceneError for the first output of the scene of a quantity that results do not have, and
        for what controllers cannot measure."""
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
        """q (nq,) at which every acceleration vanishes at rest, downhill from `q` (or the start).

        `tolerance` is how far coordinates may be off: rad, or parts of the length of what they
        move.  The array found has `residuals`, the efforts still missing by the names of speeds,
        and `unstable`, those with which it leaves a saddle.  Steps that lead downhill become those
        of Newton's method, O(bodies) each, with closed loops too; `max_steps` of them are taken at
        most, and `progress` is called with the number and the length of every one, in rad or parts
        of lengths.  Hinges that nothing counts turns of end within half a turn of the start.

        Drives are where they are at t (s), loads what they are then.  Where drives move there, what
        is found is the rest beside them, which has to last: as long as they go on, no effort may be
        missing.  Where loads or drives change later alone, `warnings` says so.

        Raises NumericalFailure naming the coordinates that nothing determines; with the efforts
        that are left, if there is no equilibrium near the start, or none at all; and where drives
        that move on do not leave it at rest.
        """
        from .equilibrium import equilibrium
        from .lasting import check_lasting

        instead = "call equilibrium for each of several"
        start = self.initial_state()[0] if q is None else single_state("q", q, self.nq, instead)
        t, tolerance = finite_float("t", t, "a time in s"), finite_float("tolerance", tolerance)
        most = integer("max_steps", max_steps, 1, "a number of steps from 1 on")
        found = equilibrium(self, start, t, tolerance, most, progress)
        linearise = partial(self.linearize, np.asarray(found), None, t, inputs=(), disturbances=())
        return check_lasting(self, found, t, linearise)

    def simulate(
        self,
        t_end: float,
        method: str | None = None,
        step: float | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        output_times: ArrayLike | Sequence[float] | None = None,
        *,
        error: float | None = None,
        error_of: str | Sequence[str] = (),
        t_start: float = 0.0,
        initial: tuple[ArrayLike, ArrayLike] | None = None,
        inputs: Mapping[str, InputValue] | None = None,
        max_step: float = 0.0,
        max_steps: int = 0,
        radius: float | None = None,
        scheme: str = "",
        iterations: int = 1,
        tangent: str = "auto",
        certify: bool = False,
        on_risk: str = "warn",
        progress: Callable[[float, float], None] | None = None,
        checkpoint: str | Path | None = None,
        resume: bool = False,
    ) -> Result:
        """Integrate to `t_end` (s).

        Args:
            method: rk4 (with `step`), dopri5, dop853, pirk13 (order 13, for smooth motions on fused
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
            error: largest error wanted of the whole run, instead of tolerances: in rad, and of
                coordinates that are no angles in parts of the largest excursion of their unit.
                Several runs find the tolerance; `Result.error_estimate` says what was reached.
            error_of: names of quantities whose error is meant, instead of all coordinates: of one
                in its unit, of several in parts of how far each goes.
            t_start: time of the start in s, which drives, loads and signals see.
            max_step, max_steps: longest step in s and largest number of steps; 0 for no limit.
            radius: spectral radius, 0 to 1, that genalpha and dttmm leave to infinitely fast motion
                (0.8); below 1 with genalpha-index3.
            scheme, iterations: of dttmm-classical; generalised-alpha, hht, newmark or wilson, with
                a number as in "hht:0.3", and how many linear solutions a step may take.
            tangent: of the equations of motion, for implicit methods: exact; laws, inertia and the
                slopes of hinges' laws alone, for those that do without the exact one (ros34pw2,
                rodas4pw, and methods that iterate); auto, exact but where iterations may begin
                with laws.
            initial: (q, u) instead of the scene's own start.
            inputs: what inputs of the scene are in this run, by their names, as in `with_inputs`:
                numbers, names of signals, (times, values), or the keys of a [[signal]].
            certify: estimate the error by a second, more accurate run.
            on_risk: where something speaks against the numbers (`Result.risks`): warn, in the
                result; refuse, which raises RiskRefused, before the run where it is seen there,
                else behind it with the result; ignore, which tells nothing in `warnings`.
            progress: called with (t, t_end) about every 0.1 s.  An exception that it raises ends
                the run and is raised here; a checkpoint is written before.
            checkpoint: file that keeps the run every 30 s, when it is interrupted, and when it has
                ended, until the result is saved.
            resume: continue from that file, if it is there, bit for bit.

        Returns a Result, also after a failure: `success`, `message` and everything computed so far.
        Raises SceneError for settings that make no sense, RiskRefused where `on_risk` asks for it.
        """
        from ..risk_checks.risk_policy import apply_policy, check_start
        from .run_results import simulate
        from .target_error.error_request import Control, parse_error_request

        model = self if inputs is None else self.with_inputs(inputs)
        certify, resume = require_bool("certify", certify), require_bool("resume", resume)
        given = Control(method, step, rtol, atol)
        wanted = parse_error_request(error, error_of, given, checkpoint is not None or resume)
        method, rtol, atol = given.filled()
        settings = validate(
            Settings(
                t_end, t_start, method, step, rtol, atol, to_output_times(output_times), max_step,
                max_steps, radius=radius, scheme=scheme, iterations=iterations,
                tangent=tangent,
            )
        )  # fmt: skip
        q, u = model.initial_state() if initial is None else split_state("initial", initial)
        instead = "simulate_batch takes many"
        q, u = (
            single_state("initial q", q, self.nq, instead),
            single_state("initial u", u, self.nu, instead),
        )
        seen = check_start(model, settings, q, u, on_risk)
        if wanted is not None:
            from .target_error import tolerance_search

            result = tolerance_search.simulate(
                model, settings, wanted, q, u, seen=seen, certify=certify, progress=progress
            )
        else:
            result = simulate(
                model, settings, q, u, seen=seen, certify=certify, progress=progress,
                checkpoint=checkpoint, resume=resume, named=given.method is not None,
            )  # fmt: skip
        return apply_policy(result, on_risk)

    def session(
        self,
        q: ArrayLike | None = None,
        u: ArrayLike | None = None,
        t: float = 0.0,
        method: str | None = None,
        step: float | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        *,
        max_step: float = 0.0,
        radius: float | None = None,
        tangent: str = "auto",
    ) -> Session:
        """A run in the caller's hands: `advance(dt, inputs={...})` goes on tick by tick.

        From q (nq,) and u (nu,), the scene's start where they are not given, at t (s).  method,
        step, rtol, atol, max_step, radius and tangent as in `simulate`, but for the methods auto,
        SciPy's, SUNDIALS' and the classical ones, which make whole runs.  A fixed step is checked
        once per model and step: what speaks against it is in `warnings` of every such session.

        Raises SceneError for settings or a state that make no sense.
        """
        from .session import Session

        at = finite_float("t", t, "a time in s")
        given = METHOD if method is None else method
        tolerances = RTOL if rtol is None else rtol, ATOL if atol is None else atol
        settings = validate(
            Settings(at, at, given, step, *tolerances, (), max_step, radius=radius, tangent=tangent)
        )
        start, instead = self.initial_state(), "make a session for each of several"
        state = (
            start[0] if q is None else single_state("q", q, self.nq, instead),
            start[1] if u is None else single_state("u", u, self.nu, instead),
        )
        return Session(self, settings, *state, self._step_risks(settings, *state))

    def _step_risks(self, settings: Settings, q: Array, u: Array) -> tuple[Risk, ...]:
        """What speaks against a fixed step at the first state from which it is to be taken."""
        if settings.step is None:
            return ()
        key = settings.method, settings.step, settings.radius
        if key not in self._steps_checked:
            from .session import step_risks

            self._steps_checked[key] = step_risks(self, settings, q, u)
        return self._steps_checked[key]

    @cached_property
    def _steps_checked(self) -> dict[tuple[str, float, float | None], tuple[Risk, ...]]:
        return {}

    def simulate_batch(
        self,
        initial_states: tuple[ArrayLike, ArrayLike],
        parameters: Mapping[str, ArrayLike] | None = None,
        *,
        t_end: float,
        inputs: Mapping[str, BatchInput] | None = None,
        output_times: ArrayLike | Sequence[float] | None = None,
        method: str = METHOD,
        step: float | None = None,
        rtol: float = RTOL,
        atol: float = ATOL,
        t_start: float = 0.0,
        max_step: float = 0.0,
        max_steps: int = 0,
        radius: float | None = None,
        tangent: str = "auto",
        threads: int | None = None,
    ) -> BatchResult:
        """Integrate n independent trajectories to `t_end` (s).

        Args:
            initial_states: q (n, nq) and u (n, nu); a single row serves all.
            parameters: numbers by name (as in `with_parameters`), (n,) or one for all.
            inputs: what inputs of the scene are, by their names: as in `simulate`, and numbers (n,)
                for each, or (times, values) and the keys of a [[signal]] with values (n, m).
            output_times: times of the samples (s, increasing); otherwise `t_end` alone.
            threads: as many as the machine has processors if not given.
            method, step, rtol, atol, t_start, max_step, max_steps, radius, tangent: as in
                `simulate`; the method auto chooses for each trajectory.

        Trajectories run side by side in the lanes of vectors, by explicit methods, where the scene
        has neither events, releases, twist springs nor drives, and over threads.  The numbers of
        one depend on no other: not on the size of the batch, its neighbours or the threads, to the
        last bit.  A trajectory that fails has `success` False, a message, and nan where it did not
        come.

        Raises SceneError for settings, shapes or parameters that make no sense.
        """
        from ..result.batch_result import BatchResult
        from ..run.batch.batch_run import prepare_batch, simulate_batch

        settings = Settings(
            t_end,
            t_start,
            method,
            step,
            rtol,
            atol,
            to_output_times(output_times),
            max_step,
            max_steps,
            radius=radius,
            tangent=tangent,
        )
        settings, q, u = prepare_batch(self, settings, initial_states)
        found = simulate_batch(
            self, settings, q, u, {} if parameters is None else parameters, inputs, threads
        )
        return BatchResult(**vars(found))


__all__ = ["Model", "NumericalFailure"]
