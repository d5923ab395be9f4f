"""`mstmm linearize` and `mstmm modes`: a scene near rest, as matrices and as natural motions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.errors import MstmmError

from ..extras import need_for
from ..options import Elements, Json, at_least, output_file
from ..simulate import compiled, use_files

if TYPE_CHECKING:
    from mstmm.runtime.linear.linear import Linear
    from mstmm.runtime.linear.motions import Modes
    from mstmm.runtime.model.model import Model

#: Rows of tables on the terminal, and coordinates that a mode's row names.
_ROWS, _NAMED = 20, 3

SceneFile = Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")]
AtStart = Annotated[
    bool,
    typer.Option("--at-start", help="At the scene's start with its speeds, not at rest."),
]  # fmt: skip
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Another number of the scene, such as "
                 "rod1.mass=2; may be repeated."),
]  # fmt: skip
Output = Annotated[
    str | None,
    typer.Option("--output", "-o", metavar="FILE", help="File for the numbers, .nc or .csv."),
]  # fmt: skip
_ENDINGS = (".nc", ".csv")


def linearize(
    scene: SceneFile,
    inputs: Annotated[
        list[str] | None,
        typer.Option("--input", "-i", metavar="NAME", help="Where it is pushed: shoulder.effort, "
                     "boom.tip.force.x, boom.tip.mz; may be repeated."),
    ] = None,
    at_start: AtStart = False,
    change: Set = None,
    output: Output = None,
    hinge: Elements = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Make a scene linear near its rest: M x'' + C x' + K x = V v + W w."""
    from .. import output as terminal

    file = _file(output)
    use_files(hinge or [])
    linear = _linear(_model(scene, change or []), inputs or [], at_start)
    if file is not None:
        linear.save(file)
    if json:
        terminal.emit_json({"scene": scene, **linear.to_dict(), "file": output})
        return
    _tell_of(linear)
    terminal.say(
        f"coordinates {len(linear)}, inputs {len(linear.inputs)}, "
        f"disturbances {len(linear.disturbances)}"
    )
    rows = [
        [name, f"{m:.5g}", f"{c:.5g}", f"{k:.5g}"]
        for name, m, c, k in zip(
            linear.coordinates, linear.M.diagonal(), linear.C.diagonal(), linear.K.diagonal(),
            strict=True,
        )
    ]  # fmt: skip
    head = ["coordinate", "M>", "C>", "K (diagonals)>"]
    terminal.console().print(terminal.table("", head, rows[:_ROWS]))
    if len(rows) > _ROWS:
        terminal.say(f"and {len(rows) - _ROWS} more")
    _where(output, "all matrices: --output FILE.csv or .nc, or --json")


def modes(
    scene: SceneFile,
    count: Annotated[
        int | None,
        typer.Option("--count", "-n", metavar="N", parser=at_least(1), help="The N slowest; all "
                     "of them unless given."),
    ] = None,
    undamped: Annotated[
        bool, typer.Option("--undamped", help="Without damping and gyroscopic loads.")
    ] = False,
    at_start: AtStart = False,
    change: Set = None,
    output: Output = None,
    hinge: Elements = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Natural motions of a scene near its rest: frequency, damping, and what moves."""
    from .. import output as terminal

    file = _file(output)
    use_files(hinge or [])
    linear = _linear(_model(scene, change or []), [], at_start)
    found = linear.modes(
        None if count is None else min(count, len(linear)), False if undamped else None
    )
    if file is not None:
        found.save(file)
    if json:
        terminal.emit_json({"scene": scene, **found.to_dict(), "file": output})
        return
    _tell_of(linear)
    head = ["mode>", "frequency in Hz>", "omega in rad/s>", "damping>", "moves most"]
    rows = [
        [str(k + 1), f"{found.frequency[k]:.6g}", f"{found.omega[k]:.6g}",
         f"{found.damping[k]:.4g}", ", ".join(found.moving(k)[:_NAMED])]
        for k in range(len(found))
    ]  # fmt: skip
    terminal.console().print(terminal.table("", head, rows[:_ROWS]))
    if len(rows) > _ROWS:
        terminal.say(f"and {len(rows) - _ROWS} more: --count N, or --output FILE.csv")
    terminal.say(_counted(found))
    _where(output, "")


def _file(output: str | None) -> Path | None:
    if output is None:
        return None
    path = output_file(output, _ENDINGS)
    need_for(path, "--output")
    return path


def _model(scene: str, changes: list[str]) -> Model:
    import mstmm

    numbers: dict[str, float] = {}
    for text in changes:
        name, equals, value = text.partition("=")
        try:
            numbers[name.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise MstmmError(f'--set {text}: expected NAME=VALUE, such as "rod1.mass=2"')
    model = compiled(scene, mstmm.load_scene(scene), engine="looped")
    return model.with_parameters(numbers) if numbers else model


def _linear(model: Model, inputs: list[str], at_start: bool) -> Linear:
    state = model.initial_state() if at_start else (None, None)
    return model.linearize(*state, inputs=inputs)


def _tell_of(linear: Linear) -> None:
    from .. import output as terminal

    for text in linear.warnings if len(linear) <= 2000 else ():
        terminal.note(f"warning: {text}")


def _counted(found: Modes) -> str:
    if found.complete is None:
        return "whether none is missing below the last was not counted: damped, or springs between"
    if found.complete:
        return "none is missing below the last: counted"
    return "some below the last are missing; ask for more: --count N"


def _where(output: str | None, other: str) -> None:
    from .. import output as terminal

    if output is not None:
        terminal.say(f"written: {output}")
    elif other:
        terminal.say(other)
