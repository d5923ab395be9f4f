"""`mstmm chart` and `mstmm advise`: CPU time against error, and the smallest sufficient model."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from mstmm.defaults import ADVICE_SAMPLES, CHART_BUDGET, CHART_ERROR, CHART_ROUNDS, CHART_SAMPLES
from mstmm.errors import SceneError

from .model_loading import compile_file, generate_elements
from .options import (
    Budget,
    Elements,
    EndTime,
    Json,
    Rounds,
    SceneFile,
    flag,
    integer_parser,
    missing_extra,
    option,
    output_file,
    output_folder,
    parse_finite,
    parse_positive,
)
from .progress import ProgressBar, progress_bar
from .terminal_output import build_table, print_json, print_lines, print_note, table_console

if TYPE_CHECKING:
    from mstmm.runtime.experiments.chart.chart import Chart
    from mstmm.runtime.experiments.model_reduction.advice import Advice

#: Longest title of a plot, in characters.
_MAX_TITLE_LENGTH = 60

#: Largest number of curves named with the reason of their omission.
_MAX_NAMED = 4

_CHART_QUANTITY_HELP = (
    "Quantity whose error is measured, such as rod1.tip.position; repeatable. Default: all "
    "coordinates."
)
_CHART_TIMES_HELP = (
    "Number of evenly spaced times at which the error is evaluated. By default more where the "
    "motion is fast."
)
_CHART_ENGINE_HELP = "auto, looped (generic C loop) or fused (C compiled for this scene)."
_ADVICE_ERROR_HELP = "Target error, above 0; below 1 unless --of names one quantity."
_OF_HELP = (
    "Quantity to which --error applies, in its unit, such as rod1.tip.position; repeatable. "
    "Default: positions of all bodies and ends, relative to the scene size."
)
_ADVICE_ENGINE_HELP = "looped (generic C loop), auto, or fused (C compiled for each model)."


@dataclass(frozen=True)
class ChartOptions:
    """Arguments of `mstmm.chart`."""

    t_end: EndTime = 10.0
    quantities: Annotated[
        list[str] | None, option("--quantity/-q", "NAME", _CHART_QUANTITY_HELP)
    ] = None
    methods: Annotated[
        list[str] | None,
        option("--method/-m", "NAME", "Method to include; repeatable. Default: all."),
    ] = None
    models: Annotated[
        bool, flag("--models", "Include the model levels of the flexible bodies.")
    ] = False
    error: Annotated[
        float, option("--error", "E", "Target error for the recommended setting.", parse_positive)
    ] = CHART_ERROR
    budget: Budget = CHART_BUDGET
    samples: Annotated[
        int | None,
        option(
            "--times", "N", _CHART_TIMES_HELP, integer_parser(2), show_default=str(CHART_SAMPLES)
        ),
    ] = None
    rounds: Rounds = CHART_ROUNDS
    engine: Annotated[str, option("--engine", "NAME", _CHART_ENGINE_HELP)] = "auto"


@dataclass(frozen=True)
class AdviceOptions:
    """Arguments of `mstmm.advise`, and the file for the reduced scene."""

    error: Annotated[float, option("--error", "E", _ADVICE_ERROR_HELP, parse_finite)] = CHART_ERROR
    of: Annotated[list[str] | None, option("--of", "NAME", _OF_HELP)] = None
    t_end: EndTime = 10.0
    write: Annotated[
        str | None, option("--write", "FILE", "File for the reduced scene, .toml.")
    ] = None
    budget: Budget = CHART_BUDGET
    samples: Annotated[
        int,
        option(
            "--times", "N", "Number of times at which the error is evaluated.", integer_parser(2)
        ),
    ] = ADVICE_SAMPLES
    rounds: Rounds = CHART_ROUNDS
    engine: Annotated[str, option("--engine", "NAME", _ADVICE_ENGINE_HELP)] = "looped"


def chart(
    scene: SceneFile,
    out: Annotated[str, option("--out", "DIR", "Folder for chart.png, .html and .json.")],
    options: ChartOptions,
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Compare all integration methods on a scene: CPU time against error."""
    folder = output_folder(out, "chart.json")
    generate_elements(hinge or [])
    import mstmm

    engine = "looped" if options.models and options.engine == "auto" else options.engine
    model = compile_file(scene, mstmm.load_scene(scene), engine=engine)
    with progress_bar("charting", moves_alone=False) as progress:
        result = mstmm.chart(
            model, **_arguments(options), title=_short_title(scene),
            progress=_progress_callback(progress, options.budget), state=print_note,
        )  # fmt: skip
    files = [str(path) for path in result.save(folder)]
    if json:
        print_json({**result.to_dict(), "scene": scene, "files": files})
    else:
        _print_chart(result, files)


def _arguments(options: ChartOptions | AdviceOptions) -> dict[str, Any]:
    """Keyword arguments of the function to which options belong; those not given are left out."""
    given = {name: value for name, value in vars(options).items() if value is not None}
    given.pop("write", None)
    return given


def _short_title(scene: str) -> str:
    """Path of the file, shortened at its beginning if it is long."""
    return scene if len(scene) <= _MAX_TITLE_LENGTH else "..." + scene[3 - _MAX_TITLE_LENGTH :]


def _progress_callback(shown: ProgressBar, budget: float) -> Callable[[str], None]:
    """Callback that shows the current work and the share of the time limit."""
    start_time = time.monotonic()

    def show(text: str) -> None:
        spent = min(time.monotonic() - start_time, budget)
        shown.label(text)
        shown.show_fraction(spent / budget, f"{spent:.0f} of {budget:g} s")

    return show


def _print_table(
    title: str, table: tuple[Sequence[str], Iterable[int], Sequence[Sequence[str]]]
) -> None:
    """Print a table of names of columns, indices of the columns of numbers, and rows."""
    head, numbers, rows = table
    columns = [name + ">" * (i in numbers) for i, name in enumerate(head)]
    table_console().print(build_table(title, columns, rows))


def _print_chart(made: Chart, files: list[str]) -> None:
    from mstmm.runtime.experiments.chart import tables

    print_lines(tables.recommendation(made))
    for title, table in (
        ("", tables.recommendation_table(made)),
        ("model levels", tables.level_table(made)),
    ):
        if table[2]:
            _print_table(title, table)
            print_lines()
    for refused, word in ((True, "does not apply"), (False, "left out")):
        for text in tables.skip_reasons(made.skipped, refused, _MAX_NAMED):
            print_lines(f"{word}: {text}")
    for text in (*missing_extra("no plot: it needs", "plot"), f"wrote {' and '.join(files)}"):
        print_lines(text)


def advise(
    scene: SceneFile, options: AdviceOptions, hinge: Elements = None, json: Json = False
) -> None:
    """Find the smallest model that meets a target error: rigid bodies, mode count, method."""
    file = None if options.write is None else output_file(options.write, (".toml",), "--write")
    if file is not None and file.exists() and Path(scene).exists() and file.samefile(scene):
        raise SceneError(f"--write {options.write}: this is the input scene; give another name")
    generate_elements(hinge or [])
    import mstmm

    model = compile_file(scene, mstmm.load_scene(scene), engine=options.engine)
    with progress_bar("advising", moves_alone=False) as progress:
        advice = mstmm.advise(
            model, **_arguments(options),
            progress=_progress_callback(progress, options.budget), state=print_note,
        )  # fmt: skip
    files = [] if file is None else [str(advice.save_scene(file))]
    if json:
        print_json({**advice.to_dict(), "file": scene, "files": files})
    else:
        _print_advice(advice, files)


def _print_advice(made: Advice, files: list[str]) -> None:
    from mstmm.runtime.experiments.model_reduction import tables

    for line in tables.summary_lines(made):
        print_lines(line)
    for title, table in (("", tables.body_table(made)), ("models tried", tables.trial_table(made))):
        if table[2]:
            print_lines()
            _print_table(title, table)
    print_lines()
    for body in made.bodies:
        print_lines(f"{body.name}: {body.reason}")
    for text in (*made.other_changes, *made.notes):
        print_lines(text)
    if files:
        print_lines(f"wrote {' and '.join(files)}")
