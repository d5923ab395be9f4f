"""What becomes of one scene: refused, run, stopped with a reason, or something that must not be."""

from __future__ import annotations

import signal
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

import mstmm
from mstmm.errors import MstmmError
from mstmm.runtime.integrate.steppers import IMPLICIT
from mstmm.runtime.model.model import Model
from mstmm.runtime.result.result import Result

T_END = 0.05
STEP = 0.01
MAX_STEPS = 400
#: Processor time (s) after which a run gets Ctrl-C, as from an impatient user.
PATIENCE = 0.5
FIRST = "dop853"
METHODS = (
    "dopri5", "rk4", "pirk13", "scipy-DOP853", "scipy-RK45", "scipy-RK23",
    "scipy-Radau", "scipy-BDF", "scipy-LSODA", "sundials-BDF", "sundials-Adams",
    "dttmm-classical", "dttmm-classical-product",
)  # fmt: skip

#: Those that take fixed steps.
FIXED = ("rk4", "wilson", "houbolt", "dttmm-classical", "dttmm-classical-product")

REFUSED, RAN, STOPPED, INTERRUPTED = "refused well", "ran", "stopped with a reason", "interrupted"
TRACEBACK, CRASH, HANG, SILENT = "traceback", "crash", "hang", "silent non-finite"
GOOD = (REFUSED, RAN, STOPPED, INTERRUPTED)
BAD = (TRACEBACK, CRASH, HANG, SILENT)


@dataclass(frozen=True)
class Outcome:
    """What came out; `detail` tells failures of one cause from those of another."""

    kind: str
    detail: str = ""
    text: str = ""


class ImpatientSignal:
    """Ctrl-C after some processor time, and whether it came."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self.came = seconds, False

    def __enter__(self) -> ImpatientSignal:
        self._before = signal.signal(signal.SIGVTALRM, self._strike)
        signal.setitimer(signal.ITIMER_VIRTUAL, self.seconds)
        return self

    def __exit__(self, *_: object) -> None:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, self._before)

    def _strike(self, *_: object) -> None:
        self.came = True
        signal.raise_signal(signal.SIGINT)


def trial(
    data: Any, begin: Callable[[str], None], turn: int | None = None, engine: str = "looped"
) -> Outcome:
    """Load, compile, ask, run and look at everything; the first thing that must not be, or the
    worst that may.

    Args:
        data: tables of the scene.
        begin: is told what comes next, before it comes: if the process ends there, that was it.
        turn: whose turn it is of the further methods and questions, some for each number; None
            for all of them.
        engine: as for `mstmm.compile`.
    """
    found: list[Outcome] = []
    model: Model | None = None
    for name, step in _steps(turn):
        begin(name)
        try:
            if model is None:
                scene = mstmm.Scene.from_data(data, "mutant")
                model = mstmm.compile(scene, engine=engine)
            else:
                found.append(step(model))
        except MstmmError as error:
            found.append(_words(error, REFUSED if model is None else STOPPED))
        except BaseException as error:
            found.append(of_exception(error, name))
        if model is None or (found and found[-1].kind in BAD):
            break
    order = [*BAD, INTERRUPTED, STOPPED, RAN, REFUSED]
    return min(found, key=lambda outcome: order.index(outcome.kind))


def _steps(turn: int | None) -> list[tuple[str, Callable[[Model], Outcome]]]:
    methods, questions = [*METHODS, *IMPLICIT], list(QUESTIONS)
    if turn is not None:
        count = len(METHODS)
        methods = [METHODS[turn % count], METHODS[(turn // 9 + turn + 4) % count]]
        methods.append(IMPLICIT[turn % len(IMPLICIT)])
        questions = [questions[turn % len(questions)]]
    runs = [(name, partial(_run, method=name)) for name in (FIRST, *methods)]
    asked = [(name, partial(_ask, question=QUESTIONS[name])) for name in questions]
    return [("compile", lambda model: Outcome(RAN)), *asked, *runs]


def _words(error: MstmmError, kind: str) -> Outcome:
    """A refusal, if it can be read."""
    lines = str(error).split("\n")
    readable = 1 <= len(lines) <= 12 and all(x.isprintable() and len(x) < 2000 for x in lines)
    return (
        Outcome(kind) if readable else Outcome(TRACEBACK, "unreadable message", str(error)[:3000])
    )


def of_exception(error: BaseException, phase: str) -> Outcome:
    """An exception that no user should meet."""
    place = _place(error.__traceback__)
    text = "".join(traceback.format_exception(error))
    return Outcome(TRACEBACK, f"{type(error).__name__} in {place} ({phase})", text[-4000:])


def _place(tb: TracebackType | None) -> str:
    """The innermost line of ours."""
    here = Path(__file__).parent
    found = "?"
    for frame, line in traceback.walk_tb(tb):
        path = Path(frame.f_code.co_filename)
        if "mstmm" in path.parts and path.parent != here:
            found = f"{path.name}:{line} {frame.f_code.co_name}"
    return found


#: What can be asked of a model without a run.
QUESTIONS: dict[str, Callable[[Model], object]] = {
    "accelerations": lambda model: model.accelerations(*model.initial_state()),
    "mass matrix": lambda model: model.mass_matrix(model.initial_state()[0]),
    "inverse dynamics": lambda model: model.inverse_dynamics(
        *model.initial_state(), np.zeros(model.nu)
    ),
    "derivatives": lambda model: model.derivatives(*model.initial_state()),
    "equilibrium": lambda model: model.equilibrium(),
}


def _ask(model: Model, question: Callable[[Model], object]) -> Outcome:
    question(model)
    return Outcome(RAN)


def _run(model: Model, method: str) -> Outcome:
    most = 0 if method.startswith("scipy-") else MAX_STEPS
    step = STEP if method in FIXED else None
    with ImpatientSignal(PATIENCE) as ctrl_c:
        try:
            result = model.simulate(
                T_END, mstmm.methods.Method(method, max_steps=most), step, certify=method == FIRST
            )
        except KeyboardInterrupt:
            return Outcome(INTERRUPTED)
    if ctrl_c.came or result.status is None:
        return Outcome(INTERRUPTED)
    bad = _silent(result, everything=method == FIRST)
    if bad:
        return Outcome(SILENT, f"{bad} ({method})", str(result.message))
    return Outcome(RAN if result.success else STOPPED)


def _silent(result: Result, everything: bool) -> str:
    """The name of what is not finite although the run succeeded and nothing warns; "" if all is."""
    str(result.certificate)
    if not result.success:
        return ""
    numbers = {"q": result.q, "u": result.u, "t": result.t, "work": result.work}
    if everything:
        numbers |= {"udot": result.udot, "energy": result.energy(), "power": result.power()}
        for name in result.quantity_names():
            try:
                numbers[name] = np.asarray(result.quantity(name).values)
            except MstmmError:
                continue
    bad = [name for name, values in numbers.items() if not np.isfinite(values).all()]
    said = " ".join(result.warnings)
    told = result._observations.failures or any(
        word in said for word in ("finite", "overflow", "nan")
    )
    if not bad or told:
        return ""
    return bad[0].rsplit(".", 1)[-1]
