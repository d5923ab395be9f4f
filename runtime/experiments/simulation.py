"""Compiled scene that can be simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from mstmm.argument_validation import require_bool
from mstmm.array_validation import Array, single_state, split_state

from ..engine.compiled_scene import CompiledScene
from ..engine.inputs import InputValue
from ..integrate.methods import Method, to_method
from ..integrate.settings import to_output_times, validate

if TYPE_CHECKING:
    from ..result.result import Result
    from .run_request import ErrorRequest, Execution


class SimulatedScene(CompiledScene):
    """Compiled scene with simulations; see `Model`."""

    def initial_state(self) -> tuple[Array, Array]:
        """Initial state (q, u) of the scene at t = 0, with driven coordinates."""
        q, u = self._initial_state
        return q.copy(), u.copy()

    @cached_property
    def _initial_state(self) -> tuple[Array, Array]:
        """Cached result of `initial_state`."""
        from ..run.start_state import initial_state

        return initial_state(self)

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
            method: a name, see `mstmm.methods.Method`, or an object of `mstmm.methods` with
                options.  Without one auto, or dop853 where `step` is given; a run that has kept to
                dop853 is recorded as one by that method.
            step: fixed step in s; otherwise `rtol` (1e-9) and `atol` (1e-12) control the step.
            output_times: times of the samples (s, increasing), a lone whole number excepted;
                otherwise every accepted step (with an error 201 samples).
            initial: (q, u) instead of the initial state of the scene.
            inputs: inputs of the scene in this run by name, as in `with_inputs`: numbers, names of
                signals, (times, values), or the keys of a [[signal]].
            error: target error of the whole run, instead of tolerances, see `ErrorRequest`: several
                runs find the tolerance, and `Result.achieved_error` is the error.
            certify: estimate the error by a second, more accurate run.
            t_start: start time in s for drives, loads and signals.
            execution: reaction to risks, progress calls, checkpoint and resumption.

        Returns a Result, also after a failure: `success`, `message` and everything computed so far.
        Raises SceneError for invalid settings, RiskRefused with on_risk = "refuse".
        """
        from .run_request import GivenAccuracy, check_execution, parse_error_request
        from .run_results import simulate

        run = check_execution(execution)
        model = self if inputs is None else self.with_inputs(inputs)
        certify = require_bool("certify", certify)
        given = GivenAccuracy(None if method is None else to_method(method), step, rtol, atol)
        request = parse_error_request(error, given, run.checkpoint is not None or run.resume)
        settings = validate(given.settings(t_end, t_start, to_output_times(output_times)))
        q, u = model.initial_state() if initial is None else split_state("initial", initial)
        remedy = "simulate_batch takes many"
        state = (
            single_state("initial q", q, self.nq, remedy),
            single_state("initial u", u, self.nu, remedy),
        )
        named = given.method_name is not None
        return simulate(model, settings, state, run, request, certify=certify, named=named)
