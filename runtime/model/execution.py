"""How a run is carried out: reaction to risks, progress calls, checkpoint."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mstmm.argument_validation import abbreviate, require_bool
from mstmm.errors import SceneError


@dataclass(frozen=True)
class Execution:
    """How `simulate` carries out a run; it does not change the numbers.

    Attributes:
        on_risk: action on objections to the result (`Result.risks`): "warn", in the result;
            "refuse", which raises RiskRefused, before the run if they are known by then, else after
            it with the result; "ignore", which leaves `warnings` empty.
        progress: called with (t, t_end) about every 0.1 s.  An exception that it raises ends the
            run and is raised by `simulate`; a checkpoint is written before.
        checkpoint: file with the state of the run, written every 30 s, on interruption, and at the
            end, until the result is saved.
        resume: continue from that file, if it exists, bit for bit.
    """

    on_risk: str = "warn"
    progress: Callable[[float, float], None] | None = None
    checkpoint: str | Path | None = None
    resume: bool = False


def check_execution(given: Execution | None) -> Execution:
    """Checked execution, the default for None.  SceneError for other types."""
    run = Execution() if given is None else given
    if not isinstance(run, Execution):
        raise SceneError(f"execution = {abbreviate(run)}: expected an mstmm.Execution")
    if run.progress is not None and not callable(run.progress):
        raise SceneError(
            f"progress = {abbreviate(run.progress)}: expected a function of (t, t_end)"
        )
    require_bool("resume", run.resume)
    return run
