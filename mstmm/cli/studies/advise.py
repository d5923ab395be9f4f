"""`mstmm advise`: the smallest model of a scene that suffices for a wanted error."""

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
        float, typer.Option("--error", metavar="E", parser=finite, help="Largest error wanted, "
                            "above 0; below 1 where it is no quantity's.")
    ] = CHART_ERROR,
    of: Annotated[
        list[str] | None,
        typer.Option("--of", metavar="NAME", help="Quantity whose error --error is, in its unit, "
                     "such as rod1.tip.position; may be repeated. The places of all bodies and "
                     "ends, in parts of the scene's length, unless given."),
    ] = None,
    t_end: Annotated[
        float, typer.Option("--t-end", metavar="S", parser=positive, help="End of the run, s.")
    ] = 10.0,
    write: Annotated[
        str | None,
        typer.Option("--write", metavar="FILE", help="Write the reduced scene, .toml."),
    ] = None,
    budget: Budget = CHART_BUDGET,
    samples: Annotated[
        int, typer.Option("--times", metavar="N", parser=at_least(2), help="Times from 0 to the "
                          "end at which errors are looked at; the largest counts.")
    ] = ADVICE_SAMPLES,
    rounds: Rounds = CHART_ROUNDS,
    engine: Annotated[
        str, typer.Option("--engine", metavar="NAME", help="looped, auto, or fused: code compiled "
                          "for each model.")
    ] = "looped",
    hinge: Elements = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Advise the smallest model that suffices: what may be rigid, how many shapes, which method."""
    from .. import output

    file = None if write is None else output_file(write, (".toml",), "--write")
    if file is not None and file.exists() and Path(scene).exists() and file.samefile(scene):
        raise SceneError(f"--write {write}: this is the scene itself; give another name")
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
