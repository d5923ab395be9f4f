"""`mstmm chart`: CPU time against error, for every method and model level of a scene."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.defaults import CHART_BUDGET, CHART_ERROR, CHART_ROUNDS, CHART_SAMPLES

from ..extras import install, missing
from ..models import compiled, use_files
from ..options import Budget, Elements, Json, Rounds, at_least, output_folder, positive
from ..progress import Bar, bar

if TYPE_CHECKING:
    from mstmm.runtime.chart.chart import Chart


#: Longest title of a plot, in characters.
_LONGEST = 60

#: Largest number of curves named with the reason of their omission.
_NAMED = 4


def chart(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")],
    out: Annotated[
        str, typer.Option("--out", metavar="DIR", help="Folder for chart.png, .html and .json.")
    ],
    t_end: Annotated[
        float, typer.Option("--t-end", metavar="S", parser=positive, help="End time, s.")
    ] = 10.0,
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", "-q", metavar="NAME", help="Quantity whose error is measured, "
                     "such as rod1.tip.position; repeatable. Default: all coordinates."),
    ] = None,
    method: Annotated[
        list[str] | None,
        typer.Option("--method", "-m", metavar="NAME", help="Method to include; repeatable. "
                     "Default: all."),
    ] = None,
    models: Annotated[
        bool, typer.Option("--models", help="Include the model levels of the flexible bodies.")
    ] = False,
    error: Annotated[
        float, typer.Option("--error", metavar="E", parser=positive, help="Target error for the "
                            "recommended setting.")
    ] = CHART_ERROR,
    budget: Budget = CHART_BUDGET,
    samples: Annotated[
        int | None,
        typer.Option("--times", metavar="N", parser=at_least(2), show_default=str(CHART_SAMPLES),
                     help="Number of evenly spaced times at which the error is evaluated. By "
                     "default more where the motion is fast."),
    ] = None,
    rounds: Rounds = CHART_ROUNDS,
    engine: Annotated[
        str, typer.Option("--engine", metavar="NAME", help="auto, looped (generic C loop) or fused "
                          "(C compiled for this scene).")
    ] = "auto",
    hinge: Elements = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Compare all integration methods on a scene: CPU time against error."""
    from .. import output

    folder = output_folder(out, "chart.json")
    use_files(hinge or [])
    import mstmm

    alike = "looped" if models and engine == "auto" else engine
    model = compiled(scene, mstmm.load_scene(scene), engine=alike)
    with bar("charting", moves_alone=False) as shown:
        made = mstmm.chart(
            model, t_end, quantities=quantity or (), methods=method or None, models=models,
            error=error, budget=budget, samples=samples, rounds=rounds, engine=engine,
            title=_title(scene), progress=follow(shown, budget), state=output.note,
        )  # fmt: skip
    files = [str(path) for path in made.save(folder)]
    if json:
        output.emit_json({**made.to_dict(), "scene": scene, "files": files})
    else:
        _say(made, files)


def _title(scene: str) -> str:
    """Path of the file, shortened at its beginning if it is long."""
    return scene if len(scene) <= _LONGEST else "..." + scene[3 - _LONGEST :]


def follow(shown: Bar, budget: float) -> Callable[[str], None]:
    """Callback that shows the current work and the share of the time limit."""
    begin = time.monotonic()

    def tell(text: str) -> None:
        spent = min(time.monotonic() - begin, budget)
        shown.label(text)
        shown.share(spent / budget, f"{spent:.0f} of {budget:g} s")

    return tell


def _say(made: Chart, files: list[str]) -> None:
    from mstmm.runtime.chart.tables import advice, levels, recommendation, told

    from .. import output

    console = output.console()
    output.say(recommendation(made))
    for title, (head, numbers, rows) in (("", advice(made)), ("model levels", levels(made))):
        if rows:
            columns = [name + ">" * (i in numbers) for i, name in enumerate(head)]
            console.print(output.table(title, columns, rows))
            output.say()
    for refused, word in ((True, "does not apply"), (False, "left out")):
        for text in told(made.left_out, refused, _NAMED):
            output.say(f"{word}: {text}")
    if missing("plot"):
        output.say(f"no plot: it needs {', '.join(missing('plot'))}: {install('plot')}")
    output.say(f"wrote {' and '.join(files)}")
