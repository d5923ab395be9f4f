"""`mstmm simulate`: run a scene, keep what was computed, say how far it can be trusted."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import (
    EnvironmentFailure,
    Interrupted,
    MstmmError,
    NumericalFailure,
    RiskRefused,
    SceneError,
)

from .extras import need_for, result_ending
from .options import (
    Elements,
    Json,
    Times,
    not_negative,
    output_file,
    positive,
    python_file,
    times,
    with_inputs,
)
from .pictures.plot import PICTURES, RESULTS
from .progress import Bar, bar, waiting

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model
    from mstmm.runtime.result.result import Result
    from mstmm.runtime.result.verdict import Verdict
    from mstmm.scene import Scene


#: A run shorter than this (s) is followed by the second one that estimates its error.
SHORT = 2.0
#: Most fixed steps of a run.
MAX_STEPS = 1e11
#: Rows of the table on the terminal.
_ROWS = 9


#: How the names of methods begin that SciPy and SUNDIALS bring.
_OF_OTHERS = ("scipy-", "sundials-")

#: How the names of the classical discrete-time method begin.
_CLASSICAL = "dttmm-classical"


@dataclass(frozen=True)
class Plan:
    """What was asked for, checked."""

    scene: str
    t_end: float
    method: str | None
    step: float | None
    rtol: float | None
    atol: float | None
    times: Times | None
    output: Path
    plot: Path | None
    quantities: tuple[str, ...]
    certify: bool | None
    resume: bool
    sweep: str = "riccati"
    engine: str = "auto"
    flexibility: str | None = None
    accuracy: float | None = None
    max_step: float = 0.0
    radius: float | None = None
    scheme: str = ""
    iterations: int = 1
    tangent: str = "auto"
    error: float | None = None
    of: tuple[str, ...] = ()
    on_risk: str = "warn"
    inputs: tuple[str, ...] = ()

    @property
    def resumable(self) -> bool:
        """Integrators of others, the classical method and runs for an error keep no checkpoints."""
        others = (self.method or METHOD).startswith((*_OF_OTHERS, _CLASSICAL))
        return self.error is None and not others

    @property
    def checkpoint(self) -> Path:
        """Where an interrupted run keeps its state."""
        return self.output.with_name(self.output.name + ".checkpoint")


def simulate(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")],
    t_end: Annotated[
        float, typer.Option("--t-end", metavar="S", parser=positive, help="End of the run, s.")
    ] = 10.0,
    method: Annotated[
        str | None,
        typer.Option(
            "--method", metavar="NAME", show_default=f"{METHOD}, auto with --error",
            help="auto, which chooses; dop853, dopri5, pirk13, rk4; for stiff motion rodas4p2, "
            "rodas5p, rodas4, ros34pw2, rodas4pw, esdirk436, kvaerno5, genalpha, dttmm, hht, "
            "newmark, wilson, houbolt, genalpha-index3, hht-index3; exprb32 for undamped "
            "vibration; dttmm-classical, dttmm-classical-product; scipy-DOP853, -RK45, "
            "-RK23, -Radau, -BDF, -LSODA; sundials-BDF, -Adams.  mstmm list tells of each."
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option("--step", metavar="S", parser=positive, help="Fixed step, s; some need it."),
    ] = None,
    rtol: Annotated[
        float | None,
        typer.Option("--rtol", metavar="X", parser=positive, show_default=f"{RTOL:g}",
                     help="Relative tolerance."),
    ] = None,
    atol: Annotated[
        float | None,
        typer.Option("--atol", metavar="X", parser=not_negative, show_default=f"{ATOL:g}",
                     help="Absolute tolerance."),
    ] = None,
    error: Annotated[
        float | None,
        typer.Option("--error", metavar="X", parser=positive, help="Error wanted of the whole run, "
                     "instead of tolerances: rad, or part of the motion; several runs reach it."),
    ] = None,
    of: Annotated[
        list[str] | None,
        typer.Option("--of", metavar="NAME", help="Quantity whose error --error is, in its unit, "
                     "such as rod1.tip.position; may be repeated."),
    ] = None,
    max_step: Annotated[
        float | None,
        typer.Option("--max-step", metavar="S", parser=positive, help="Longest step of a method "
                     "that chooses its steps, s: no narrow part of a force is passed over."),
    ] = None,
    radius: Annotated[
        float | None,
        typer.Option("--radius", metavar="X", parser=not_negative, help="Spectral radius, 0 to 1, "
                     "that genalpha and dttmm leave to infinitely fast motion (0.8)."),
    ] = None,
    times: Annotated[
        Times | None,
        typer.Option(
            "--times", metavar="N|DT", parser=times,
            help="Samples: how many (201), or how far apart in s (0.05, 1s); else every step.",
        ),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Result, .nc, .csv or .mat; by default "
                     "the scene's name, here."),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option("--plot", metavar="FILE", help="Picture, .png, .svg or .pdf."),
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", "-q", metavar="NAME", help="What to plot and to print, such as "
                     "shoulder.angle, rod1.tip.position, energy; may be repeated."),
    ] = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option("--input", metavar="NAME=VALUE", help="What an input of the scene is: a "
                     "number, or the name of a signal of it; may be repeated."),
    ] = None,
    hinge: Elements = None,
    certify: Annotated[
        bool | None,
        typer.Option("--certify/--no-certify", help="Estimate the error by a second, more accurate "
                     "run; by default after short runs."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted run, with the same options.")
    ] = False,
    sweep: Annotated[
        str,
        typer.Option("--sweep", metavar="NAME", help="riccati, qr: as least squares, for heavy "
                     "bodies behind light ones, or product: the plain product of transfer "
                     "matrices, for chains, guarded."),
    ] = "riccati",
    engine: Annotated[
        str,
        typer.Option("--engine", metavar="NAME", help="auto, looped, or fused: code compiled for "
                     "this scene."),
    ] = "auto",
    flexibility: Annotated[
        str | None,
        typer.Option("--flexibility", metavar="LEVEL", help="coupled, one-way, or rigid: level of "
                     "model of all flexible bodies; by default as the scene says."),
    ] = None,
    scheme: Annotated[
        str,
        typer.Option("--scheme", metavar="NAME", help="Of dttmm-classical: generalised-alpha, hht, "
                     "newmark or wilson, with a number as in hht:0.3."),
    ] = "",
    iterations: Annotated[
        int,
        typer.Option("--iterations", metavar="N", help="Of dttmm-classical: linear solutions that "
                     "a step may take."),
    ] = 1,
    tangent: Annotated[
        str,
        typer.Option("--tangent", metavar="NAME", help="Of implicit methods: auto, exact, or laws, "
                     "the slopes of hinges' laws alone, for those that allow it."),
    ] = "auto",
    accuracy: Annotated[
        float | None,
        typer.Option("--accuracy", metavar="X", parser=positive, help="Error up to which the "
                     "result counts as trusted: rad, or part of the motion (0.01)."),
    ] = None,
    on_risk: Annotated[
        str,
        typer.Option("--on-risk", metavar="WORD", help="Where something speaks against the "
                     "numbers: warn; refuse, before the run where it is seen there, else with "
                     "exit code 4 once the result is saved; ignore, which tells nothing."),
    ] = "warn",
    json: Json = False,
) -> None:  # fmt: skip
    """Simulate a scene and save the result; Ctrl-C keeps what was computed."""
    plan = Plan(
        scene, t_end, method, step, rtol, atol, times,
        output_file(_default_output(scene) if output is None else output, RESULTS),
        None if plot is None else output_file(plot, PICTURES, "--plot"),
        tuple(quantity or ()), certify, resume, sweep, engine, flexibility, accuracy,
        max_step or 0.0, radius, scheme, iterations, tangent, error, tuple(of or ()),
        on_risk, tuple(inputs or ()),
    )  # fmt: skip
    _refuse_endless(plan)
    _refuse_beside_error(plan)

    need_for(plan.output, "--output")
    if plan.plot is not None:
        need_for(plan.plot, "--plot")
    use_files(hinge or [])
    model = _model(plan)
    load_method(plan.method or METHOD)
    with bar() as progress, _kept_if_interrupted(plan.checkpoint):
        begin = time.perf_counter()
        result, refused = _run(plan, model, progress)
        seconds = time.perf_counter() - begin
        with _kept_if_it_fails(plan.checkpoint):
            result = _saved(plan, result, seconds, progress)
    if plan.plot is not None:
        result.plot(*plan.quantities, path=plan.plot, title=Path(plan.scene).stem)
    _report(plan, result, seconds + result.trajectory.before, json, refused)
    if interrupted(result):
        raise typer.Exit(130)
    if not result.success:
        raise typer.Exit(NumericalFailure.exit_code)
    if refused is not None:
        raise typer.Exit(_said(plan, refused))


def _said(plan: Plan, refused: RiskRefused) -> int:
    """The exit code of a result whose risks are refused, once they are told."""
    from . import output

    output.complain(f"{plan.scene}: {refused}\nwhat was computed is in {plan.output}")
    return refused.exit_code


def _refuse_endless(plan: Plan) -> None:
    """A step so small that no machine would ever reach the end."""
    if plan.step is not None and plan.t_end / plan.step > MAX_STEPS:
        raise MstmmError(
            f"--step {plan.step:g}: {plan.t_end / plan.step:.1e} steps would never end; "
            f"take {plan.t_end / MAX_STEPS:.1e} s or more"
        )


def _refuse_beside_error(plan: Plan) -> None:
    """Several runs are made for an error, of which none is kept to go on from; and what is trusted
    is what was asked for."""
    if plan.error is not None and plan.resume:
        raise MstmmError(
            "--resume: there is no checkpoint of runs with --error; run it again, or take the "
            "method and the tolerances that such a run has found"
        )
    if plan.error is not None and plan.accuracy is not None:
        raise MstmmError(
            "--accuracy beside --error: a result counts as trusted that reaches --error; leave "
            "--accuracy out"
        )


def _default_output(scene: str) -> str:
    stem = Path(scene).stem or "result"
    return stem + result_ending()


def use_files(paths: list[str]) -> None:
    """Generate the elements of Python files, so that scenes can name them.  Executes the files."""
    if paths:
        import mstmm

        for path in paths:
            mstmm.generate_file(python_file(path))


def _model(plan: Plan) -> Model:
    """The compiled scene, with every quantity that was asked for in it."""
    import mstmm
    from mstmm.scene.rules.messages import near

    scene, level = mstmm.load_scene(plan.scene), plan.flexibility
    if plan.inputs:
        scene = with_inputs(scene, plan.inputs)
    model = compiled(plan.scene, scene, plan.sweep, plan.engine, level)
    if plan.quantities:
        start = model.simulate(t_end=0.0, method="dop853")
        pictures = start.pictures()
        for name in plan.quantities:
            try:
                if name not in pictures:
                    start.quantity(name)
            except SceneError as error:
                hint = near(name, pictures)
                meant = "did you mean" in hint
                text = f'"{name}": there is no such quantity or picture{hint}' if meant else error
                raise SceneError(f"--quantity {text}") from None
    return model


def compiled(
    path: str,
    scene: Scene,
    sweep: str = "riccati",
    engine: str = "auto",
    flexibility: str | None = None,
) -> Model:
    """The model of a scene file.

    SceneError, with the file named, also where the accelerations of the start cannot be computed:
    then the scene is at fault.
    """
    import numpy as np

    import mstmm

    try:
        with waiting("preparing the scene"):
            model = mstmm.compile(scene, engine=engine, sweep=sweep, flexibility=flexibility)
            udot = model.accelerations(*model.initial_state())
    except (SceneError, NumericalFailure) as error:
        lines = str(error).splitlines()
        named = (f"{path}: " + line.removeprefix("scene: ") for line in lines)
        raise SceneError("\n".join(named)) from None
    if not np.isfinite(udot).all():
        raise SceneError(f"{path}: the accelerations at the start are not finite")
    return model


def _run(plan: Plan, model: Model, progress: Bar) -> tuple[Result, RiskRefused | None]:
    """The result; and what --on-risk refuse says of it, if it does."""
    if plan.resume and not plan.checkpoint.is_file():
        raise MstmmError(
            f"--resume: there is no checkpoint {plan.checkpoint}; it is written when a run is "
            "interrupted, beside its --output"
        )
    try:
        result = model.simulate(
            plan.t_end, plan.method, plan.step, plan.rtol, plan.atol,
            None if plan.times is None else plan.times.until(plan.t_end),
            max_step=plan.max_step, radius=plan.radius, scheme=plan.scheme,
            iterations=plan.iterations, tangent=plan.tangent, error=plan.error, error_of=plan.of,
            on_risk=plan.on_risk, progress=progress, resume=plan.resume,
            checkpoint=str(plan.checkpoint) if plan.resumable else None,
        )  # fmt: skip
    except RiskRefused as refused:
        if refused.result is None:
            raise
        return refused.result, refused
    return result, None


def _saved(plan: Plan, result: Result, seconds: float, progress: Bar) -> Result:
    """The result in its place, with its error estimated where that was asked for.

    The checkpoint goes with the last step, so that every part can be done again.  A run that was
    resumed is no short one.
    """
    short = seconds < SHORT and not plan.resume and plan.error is None
    if result.trajectory.success and (short if plan.certify is None else plan.certify):
        from mstmm.runtime.result.output import storage

        storage.save(result, plan.output)
        from mstmm.runtime.model.results import certified

        progress.label("estimating the error")
        result = certified(result, progress)
    result.save(plan.output)
    return result


@contextmanager
def _kept_if_interrupted(checkpoint: Path) -> Iterator[None]:
    """An interrupt beside the run itself says what there is to go on from."""
    try:
        yield
    except KeyboardInterrupt:
        if not checkpoint.is_file():
            raise
        raise Interrupted(f"interrupted; {_kept(checkpoint)}") from None


@contextmanager
def _kept_if_it_fails(checkpoint: Path) -> Iterator[None]:
    """What goes wrong while a result is saved costs no run: the message says where it is kept."""
    try:
        yield
    except (MstmmError, MemoryError) as error:
        if not checkpoint.is_file():
            raise
        if isinstance(error, MstmmError):
            raise type(error)(f"{error}; {_kept(checkpoint)}") from None
        raise EnvironmentFailure(
            "there is not enough memory to evaluate all samples and to save them; "
            f"{_kept(checkpoint)} where there is more memory, or run it again with fewer --times"
        ) from None


def _kept(checkpoint: Path) -> str:
    return f"the run is kept in {checkpoint}; continue with the same command and --resume"


def load_method(name: str) -> None:
    """Read a method's coefficients, so that the time of a run is the run's.

    SceneError for a method that does not exist, EnvironmentFailure for one whose package is not
    installed.
    """
    from mstmm.runtime.run import classical, sundials

    if name in classical.METHODS:
        return
    if name in sundials.METHODS:
        sundials.refuse_without(name)
    elif not name.startswith(_OF_OTHERS):
        from mstmm.runtime.integrate.steppers import AUTO, AUTO_EXPLICIT, get

        get(AUTO_EXPLICIT if name == AUTO else name)


def interrupted(result: Result) -> bool:
    """True if Ctrl-C or SIGTERM ended the run."""
    return result.status is None


# --- what it says ---------------------------------------------------------------------------------


def _report(
    plan: Plan, result: Result, seconds: float, json: bool, refused: RiskRefused | None
) -> None:
    from . import output, summary

    made = [str(path) for path in (plan.output, plan.plot) if path is not None]
    if json:
        data = summary.to_json(result, seconds, _verdict(plan, result))
        data |= {"scene": plan.scene, "files": made}
        if refused is not None:
            data["error"] = {
                "type": type(refused).__name__, "message": str(refused),
                "exit_code": refused.exit_code,
            }  # fmt: skip
        if interrupted(result) and plan.resumable:
            data["checkpoint"] = str(plan.checkpoint)
        output.emit_json(data)
    else:
        _say(plan, result, seconds, made)
    if interrupted(result) and plan.resumable:
        output.complain(f"{result.message}; continue with the same command and --resume")
    elif interrupted(result):
        output.complain(f"{result.message}; what was computed is in {plan.output}")
    elif not result.success:
        output.complain(f"{plan.scene}: {result.message}; what was computed is in {plan.output}")


def _verdict(plan: Plan, result: Result) -> Verdict:
    given = result.certificate
    return given.verdict() if plan.accuracy is None else given.verdict(plan.accuracy)


def _say(plan: Plan, result: Result, seconds: float, made: list[str]) -> None:
    from . import output, summary

    console = output.console()
    verdict, told = _verdict(plan, result), result.trajectory.told
    for line in summary.verdict_lines(verdict, console.width, told):
        output.say(line)
    output.say(f"{plan.scene}: {summary.sizes(result)}, {result.model.engine} engine")
    output.say(summary.effort(result, seconds))
    for line in summary.method_lines(result, console.width):
        output.say(line)
    output.say(result.message)
    if len(result.t):
        output.say()
        output.say(summary.fitting_table(result, plan.quantities, _ROWS, console.width))
    output.say()
    for line in summary.certificate_lines(result, console.width):
        output.say(line)
    output.say()
    output.say(f"wrote {' and '.join(made)} ({summary.count(len(result.t), 'sample')})")
