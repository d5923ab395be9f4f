"""`mstmm chart`: CPU time against error, for every method and model level of a scene."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.defaults import CHART_BUDGET, CHART_ERROR, CHART_ROUNDS, CHART_SAMPLES

from ..extra_checks import install_command, missing_packages
from ..model_loading import compile_file, generate_elements
from ..options import Budget, Elements, Json, Rounds, integer_parser, output_folder, parse_positive
from ..progress import ProgressBar, progress_bar

if TYPE_CHECKING:
    from mstmm.runtime.chart.chart import Chart


#: Longest title of a plot, in characters.
_MAX_TITLE_LENGTH = 60

#: Largest number of curves named with the reason of their omission.
_MAX_NAMED = 4


def chart(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")],
    out: Annotated[
        str, typer.Option("--out", metavar="DIR", help="Folder for chart.png, .html and .json.")
    ],
    t_end: Annotated[
        float, typer.Option("--t-end", metavar="S", parser=parse_positive, help="End time, s.")
    ] = 10.0,
    quantity: Annotated[
        list[str] | None,
        typer.Option(
            "--quantity",
            "-q",
            metavar="NAME",
            help="Quantity whose error is measured, "
            "such as rod1.tip.position; repeatable. Default: all coordinates.",
        ),
    ] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(
            "--method", "-m", metavar="NAME", help="Method to include; repeatable. Default: all."
        ),
    ] = None,
    models: Annotated[
        bool, typer.Option("--models", help="Include the model levels of the flexible bodies.")
    ] = False,
    error: Annotated[
        float,
        typer.Option(
            "--error",
            metavar="E",
            parser=parse_positive,
            help="Target error for the recommended setting.",
        ),
    ] = CHART_ERROR,
    budget: Budget = CHART_BUDGET,
    samples: Annotated[
        int | None,
        typer.Option(
            "--times",
            metavar="N",
            parser=integer_parser(2),
            show_default=str(CHART_SAMPLES),
            help="Number of evenly spaced times at which the error is evaluated. By "
            "default more where the motion is fast.",
        ),
    ] = None,
    rounds: Rounds = CHART_ROUNDS,
    engine: Annotated[
        str,
        typer.Option(
            "--engine",
            metavar="NAME",
            help="auto, looped (generic C loop) or fused (C compiled for this scene).",
        ),
    ] = "auto",
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Compare all integration methods on a scene: CPU time against error."""
    from .. import terminal_output

    folder = output_folder(out, "chart.json")
    generate_elements(hinge or [])
    import mstmm

    engine_name = "looped" if models and engine == "auto" else engine
    model = compile_file(scene, mstmm.load_scene(scene), engine=engine_name)
    with progress_bar("charting", moves_alone=False) as progress:
        result = mstmm.chart(
            model,
            t_end,
            quantities=quantity or (),
            methods=method or None,
            models=models,
            error=error,
            budget=budget,
            samples=samples,
            rounds=rounds,
            engine=engine,
            title=_short_title(scene),
            progress=progress_callback(progress, budget),
            state=terminal_output.print_note,
        )
    files = [str(path) for path in result.save(folder)]
    if json:
        terminal_output.print_json({**result.to_dict(), "scene": scene, "files": files})
    else:
        _print_chart(result, files)


def _short_title(scene: str) -> str:
    """Path of the file, shortened at its beginning if it is long."""
    return scene if len(scene) <= _MAX_TITLE_LENGTH else "..." + scene[3 - _MAX_TITLE_LENGTH :]


def progress_callback(shown: ProgressBar, budget: float) -> Callable[[str], None]:
    """Callback that shows the current work and the share of the time limit."""
    start_time = time.monotonic()

    def show(text: str) -> None:
        spent = min(time.monotonic() - start_time, budget)
        shown.label(text)
        shown.show_fraction(spent / budget, f"{spent:.0f} of {budget:g} s")

    return show


def _print_chart(made: Chart, files: list[str]) -> None:
    from mstmm.runtime.chart.tables import (
        level_table,
        recommendation,
        recommendation_table,
        skip_reasons,
    )

    from .. import terminal_output

    console = terminal_output.table_console()
    terminal_output.print_lines(recommendation(made))
    for title, (head, numbers, rows) in (
        ("", recommendation_table(made)),
        ("model levels", level_table(made)),
    ):
        if rows:
            columns = [name + ">" * (i in numbers) for i, name in enumerate(head)]
            console.print(terminal_output.build_table(title, columns, rows))
            terminal_output.print_lines()
    for refused, word in ((True, "does not apply"), (False, "left out")):
        for text in skip_reasons(made.skipped, refused, _MAX_NAMED):
            terminal_output.print_lines(f"{word}: {text}")
    if missing_packages("plot"):
        terminal_output.print_lines(
            f"no plot: it needs {', '.join(missing_packages('plot'))}: {install_command('plot')}"
        )
    terminal_output.print_lines(f"wrote {' and '.join(files)}")
