"""`mstmm advise`: smallest model of a scene that meets a target error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.defaults import ADVICE_SAMPLES, CHART_BUDGET, CHART_ERROR, CHART_ROUNDS
from mstmm.errors import SceneError

from ..models import compiled, use_files
from ..options import Budget, Elements, Json, Rounds, at_least, finite, output_file, positive
from ..progress import bar
from .chart import follow

if TYPE_CHECKING:
    from mstmm.runtime.advice.record import Advice


def advise(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")],
    error: Annotated[
        float, typer.Option("--error", metavar="E", parser=finite, help="Target error, above 0; "
                            "below 1 unless --of names one quantity.")
    ] = CHART_ERROR,
    of: Annotated[
        list[str] | None,
        typer.Option("--of", metavar="NAME", help="Quantity to which --error applies, in its unit, "
                     "such as rod1.tip.position; repeatable. Default: positions of all bodies and "
                     "ends, relative to the scene size."),
    ] = None,
    t_end: Annotated[
        float, typer.Option("--t-end", metavar="S", parser=positive, help="End time, s.")
    ] = 10.0,
    write: Annotated[
        str | None,
        typer.Option("--write", metavar="FILE", help="File for the reduced scene, .toml."),
    ] = None,
    budget: Budget = CHART_BUDGET,
    samples: Annotated[
        int, typer.Option("--times", metavar="N", parser=at_least(2), help="Number of times at "
                          "which the error is evaluated.")
    ] = ADVICE_SAMPLES,
    rounds: Rounds = CHART_ROUNDS,
    engine: Annotated[
        str, typer.Option("--engine", metavar="NAME", help="looped (generic C loop), auto, or "
                          "fused (C compiled for each model).")
    ] = "looped",
    hinge: Elements = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Find the smallest model that meets a target error: rigid bodies, mode count, method."""
    from .. import output

    file = None if write is None else output_file(write, (".toml",), "--write")
    if file is not None and file.exists() and Path(scene).exists() and file.samefile(scene):
        raise SceneError(f"--write {write}: this is the input scene; give another name")
    use_files(hinge or [])
    import mstmm

    model = compiled(scene, mstmm.load_scene(scene), engine=engine)
    with bar("advising", moves_alone=False) as shown:
        made = mstmm.advise(
            model, t_end, error=error, of=of or (), budget=budget, samples=samples, rounds=rounds,
            engine=engine, progress=follow(shown, budget), state=output.note,
        )  # fmt: skip
    files = [] if file is None else [str(made.write(file))]
    if json:
        output.emit_json({**made.to_dict(), "file": scene, "files": files})
    else:
        _say(made, files)


def _say(made: Advice, files: list[str]) -> None:
    from mstmm.runtime.advice.tables import bodies, summary, tried

    from .. import output

    for line in summary(made):
        output.say(line)
    console = output.console()
    for title, (head, numbers, rows) in (("", bodies(made)), ("models tried", tried(made))):
        if rows:
            columns = [name + ">" * (i in numbers) for i, name in enumerate(head)]
            output.say()
            console.print(output.table(title, columns, rows))
    output.say()
    for body in made.bodies:
        output.say(f"{body.name}: {body.reason}")
    for text in (*made.changes, *made.notes):
        output.say(text)
    if files:
        output.say(f"wrote {' and '.join(files)}")
