"""`mstmm simulate`: run a scene, save the result and report whether it can be trusted."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import MISSING, fields
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer

from mstmm.defaults import METHOD
from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.integrate.methods import FAMILIES

from ..extra_checks import require_extra_for
from ..model_loading import compile_file, generate_elements, load_method
from ..options import integer_parser, parse_not_negative, with_inputs
from ..progress import progress_bar
from .resumable_run import (
    keep_checkpoint_on_error,
    keep_checkpoint_on_interrupt,
    save_result,
    simulate_plan,
)
from .run_options import RunOptions
from .run_output import print_risks, report_run, was_interrupted

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model


def _simulate(plan: RunOptions) -> None:
    """Simulate a scene and save the result; Ctrl-C saves what has been computed."""
    plan.check()
    require_extra_for(plan.result_file, "--output")
    if plan.plot_file is not None:
        require_extra_for(plan.plot_file, "--plot")
    generate_elements(plan.hinge or [])
    model = _compile_model(plan)
    load_method(plan.method or METHOD)
    with progress_bar() as progress, keep_checkpoint_on_interrupt(plan.checkpoint):
        start_time = time.perf_counter()
        result, rejection = simulate_plan(plan, model, progress)
        seconds = time.perf_counter() - start_time
        with keep_checkpoint_on_error(plan.checkpoint):
            result = save_result(plan, result, seconds, progress)
    if plan.plot_file is not None:
        result.plot(*(plan.quantity or ()), path=plan.plot_file, title=Path(plan.scene).stem)
    report_run(plan, result, seconds + result.trajectory.earlier_seconds, rejection)
    if was_interrupted(result):
        raise typer.Exit(130)
    if not result.success:
        raise typer.Exit(NumericalFailure.exit_code)
    if rejection is not None:
        raise typer.Exit(print_risks(plan, rejection))


def _compile_model(plan: RunOptions) -> Model:
    """Compile the scene, and check that it has all requested quantities."""
    import mstmm
    from mstmm.scene.validators.validation_messages import did_you_mean

    scene, level = mstmm.load_scene(plan.scene), plan.flexibility
    if plan.inputs:
        scene = with_inputs(scene, plan.inputs)
    turns = plan.simplify if plan.turns is None else plan.turns
    simplifications = {"welds": plan.simplify, "turns": turns, "links": plan.simplify}
    model = compile_file(plan.scene, scene, plan.sweep, plan.engine, level, simplifications)
    if plan.quantity:
        start_result = model.simulate(t_end=0.0, method="dop853")
        pictures = start_result.picture_names()
        for name in plan.quantity:
            try:
                if name not in pictures:
                    start_result.quantity(name)
            except SceneError as error:
                hint = did_you_mean(name, pictures)
                has_suggestion = "did you mean" in hint
                text = (
                    f'"{name}": there is no such quantity or picture{hint}'
                    if has_suggestion
                    else error
                )
                raise SceneError(f"--quantity {text}") from None
    return model


# --- command line ---------------------------------------------------------------------------------

_PARSERS: dict[type, Callable[[Any], Any] | None] = {
    float: parse_not_negative, int: integer_parser(0), str: None,
}  # fmt: skip


def _command_with_options(run: Callable[[RunOptions], None]) -> Callable[..., None]:
    """Command with a parameter for each field of RunOptions and each option of a method.

    `run` receives the options; `method_options` has the values of those given for the method.
    """
    hints = get_type_hints(RunOptions, include_extras=True)
    method_parameters = _method_parameters()
    parameters = [
        Parameter(
            item.name,
            Parameter.KEYWORD_ONLY,
            default=Parameter.empty if item.default is MISSING else item.default,
            annotation=hints[item.name],
        )
        for item in fields(RunOptions)
        if item.name != "method_options"
    ] + method_parameters

    def command(**values: Any) -> None:
        given = {p.name: values.pop(p.name) for p in method_parameters}
        method_options = {name: value for name, value in given.items() if value is not None}
        run(RunOptions(**values, method_options=method_options))

    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    command.__doc__, command.__name__ = run.__doc__, run.__name__
    return command


def _method_parameters() -> list[Parameter]:
    """One parameter for each option of integration methods; None where not given."""
    parameters: dict[str, Parameter] = {}
    for family in FAMILIES:
        hints = get_type_hints(family)
        for item in fields(family):
            if item.name == "name":
                continue
            kind: Any = (get_args(hints[item.name]) or (hints[item.name],))[0]
            option = typer.Option(
                f"--{item.name.replace('_', '-')}", metavar=item.metadata["metavar"],
                help=item.metadata["description"], parser=_PARSERS[kind],
            )  # fmt: skip
            annotation: Any = Annotated[kind | None, option]
            parameters[item.name] = Parameter(
                item.name, Parameter.KEYWORD_ONLY, default=None, annotation=annotation
            )
    return list(parameters.values())


simulate = _command_with_options(_simulate)
