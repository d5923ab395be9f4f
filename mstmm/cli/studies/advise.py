"""`mstmm advise`: smallest model of a scene that meets a target error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.defaults import ADVICE_SAMPLES, CHART_BUDGET, CHART_ERROR, CHART_ROUNDS
from mstmm.errors import SceneError

from ..model_loading import compile_file, generate_elements
from ..options import (
    Budget,
    Elements,
    Json,
    Rounds,
    integer_parser,
    output_file,
    parse_finite,
    parse_positive,
)
from ..progress import progress_bar
from .chart import progress_callback

if TYPE_CHECKING:
    from mstmm.runtime.advice.advice import Advice


def advise(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")],
    error: Annotated[
        float,
        typer.Option(
            "--error",
            metavar="E",
            parser=parse_finite,
            help="Target error, above 0; below 1 unless --of names one quantity.",
        ),
    ] = CHART_ERROR,
    of: Annotated[
        list[str] | None,
        typer.Option(
            "--of",
            metavar="NAME",
            help="Quantity to which --error applies, in its unit, "
            "such as rod1.tip.position; repeatable. Default: positions of all bodies and "
            "ends, relative to the scene size.",
        ),
    ] = None,
    t_end: Annotated[
        float, typer.Option("--t-end", metavar="S", parser=parse_positive, help="End time, s.")
    ] = 10.0,
    write: Annotated[
        str | None,
        typer.Option("--write", metavar="FILE", help="File for the reduced scene, .toml."),
    ] = None,
    budget: Budget = CHART_BUDGET,
    samples: Annotated[
        int,
        typer.Option(
            "--times",
            metavar="N",
            parser=integer_parser(2),
            help="Number of times at which the error is evaluated.",
        ),
    ] = ADVICE_SAMPLES,
    rounds: Rounds = CHART_ROUNDS,
    engine: Annotated[
        str,
        typer.Option(
            "--engine",
            metavar="NAME",
            help="looped (generic C loop), auto, or fused (C compiled for each model).",
        ),
    ] = "looped",
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Find the smallest model that meets a target error: rigid bodies, mode count, method."""
    from .. import terminal_output

    file = None if write is None else output_file(write, (".toml",), "--write")
    if file is not None and file.exists() and Path(scene).exists() and file.samefile(scene):
        raise SceneError(f"--write {write}: this is the input scene; give another name")
    generate_elements(hinge or [])
    import mstmm

    model = compile_file(scene, mstmm.load_scene(scene), engine=engine)
    with progress_bar("advising", moves_alone=False) as progress:
        advice = mstmm.advise(
            model,
            t_end,
            error=error,
            of=of or (),
            budget=budget,
            samples=samples,
            rounds=rounds,
            engine=engine,
            progress=progress_callback(progress, budget),
            state=terminal_output.print_note,
        )
    files = [] if file is None else [str(advice.save_scene(file))]
    if json:
        terminal_output.print_json({**advice.to_dict(), "file": scene, "files": files})
    else:
        _print_advice(advice, files)


def _print_advice(made: Advice, files: list[str]) -> None:
    from mstmm.runtime.advice.tables import body_table, summary_lines, trial_table

    from .. import terminal_output

    for line in summary_lines(made):
        terminal_output.print_lines(line)
    console = terminal_output.table_console()
    for title, (head, numbers, rows) in (
        ("", body_table(made)),
        ("models tried", trial_table(made)),
    ):
        if rows:
            columns = [name + ">" * (i in numbers) for i, name in enumerate(head)]
            terminal_output.print_lines()
            console.print(terminal_output.build_table(title, columns, rows))
    terminal_output.print_lines()
    for body in made.bodies:
        terminal_output.print_lines(f"{body.name}: {body.reason}")
    for text in (*made.other_changes, *made.notes):
        terminal_output.print_lines(text)
    if files:
        terminal_output.print_lines(f"wrote {' and '.join(files)}")
