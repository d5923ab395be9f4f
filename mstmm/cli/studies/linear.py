"""`mstmm linearize`, `mstmm modes` and `mstmm frf`: linear models about an operating point."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.errors import MstmmError

from ..options import Elements, Json, at_least, positive
from .asked import Asked, AtStart, Friction, Output, Plot, SceneFile, Set, number_or_named

if TYPE_CHECKING:
    from mstmm.arrays import Array
    from mstmm.risk import Assessed
    from mstmm.runtime.linear.linear import Linear
    from mstmm.runtime.linear.motions import Modes

#: Rows of tables on the terminal; coordinates and bodies named in the row of a mode.
_ROWS, _NAMED, _OWNERS = 20, 3, 2
#: Largest entry of A that counts as rounding, relative to the largest entry.
_ROUNDING = 1e-12
#: Largest number of coordinates for a search of peaks near all modes; damping ratio assumed then.
_ALL_MOTIONS, _SOME_DAMPING = 400, 1e-6


def linearize(
    scene: SceneFile,
    inputs: Annotated[
        list[str] | None,
        typer.Option("--input", "-i", metavar="NAME", help="Input, such as shoulder.effort, "
                     "strut.effort, boom.tip.force.x, boom.tip.mz, or a scene input; repeatable.  "
                     "Default: the scene's inputs."),
    ] = None,
    friction: Friction = None,
    at_start: AtStart = False,
    change: Set = None,
    output: Output = None,
    plot: Plot = None,
    hinge: Elements = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Linearise a scene about its static equilibrium: M x'' + C x' + K x = V v + W w."""
    from .. import output as terminal

    asked = Asked(scene, at_start, change, output, plot, hinge, json, friction)
    linear = asked.linear(inputs)
    if asked.answered(linear):
        return
    _print_assessment(linear)
    terminal.say(
        f"coordinates {len(linear)}, inputs {len(linear.inputs)}, "
        f"disturbances {len(linear.disturbances)}"
    )
    head, rows = _rows_of(linear)
    terminal.console().print(terminal.table("", head, rows[:_ROWS]))
    if len(rows) > _ROWS:
        terminal.say(f"and {len(rows) - _ROWS} more")
    asked.say_where("all matrices: --output FILE.csv or .nc, or --json")


def _rows_of(linear: Linear) -> tuple[list[str], list[list[str]]]:
    """Table of the diagonals of M, C and K; for a first-order model the largest entries of A."""
    if linear.has_stiffness:
        diagonals = (matrix.diagonal() for matrix in (linear.M, linear.C, linear.K))
        numbers = ([f"{x:.5g}" for x in row] for row in zip(*diagonals, strict=True))
        rows = [[name, *row] for name, row in zip(linear.coordinates, numbers, strict=True)]
        return ["coordinate", "M>", "C>", "K (diagonals)>"], rows
    rows, rounding = [], _ROUNDING * abs(linear.A).max(initial=0.0)
    for name, row in zip(linear.states, linear.A, strict=True):
        largest = (-abs(row)).argsort(kind="stable")[:_NAMED]
        places = [k for k in largest if abs(row[k]) > rounding]
        rows.append([name, ", ".join(f"{row[k]:.5g} {linear.states[k]}" for k in places)])
    return ["state", "rate (largest entries of A)"], rows


def modes(
    scene: SceneFile,
    count: Annotated[
        int | None,
        typer.Option("--count", "-n", metavar="N", parser=at_least(1), help="Number of lowest "
                     "modes; default: all."),
    ] = None,
    undamped: Annotated[
        bool, typer.Option("--undamped", help="Ignore damping and gyroscopic terms.")
    ] = False,
    friction: Friction = None,
    at_start: AtStart = False,
    change: Set = None,
    output: Output = None,
    plot: Plot = None,
    seen: Annotated[
        str | None,
        typer.Option("--view", metavar="FILE", help="Animate the modes: .html, strip (.png, .svg, "
                     ".pdf) or film (.gif, .mp4)."),
    ] = None,
    hinge: Elements = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Compute normal modes about the static equilibrium: frequencies, damping ratios, shapes."""
    from .. import output as terminal

    asked = Asked(scene, at_start, change, output, plot, hinge, json, friction, seen)
    linear = asked.linear(None)
    most = None if count is None or not len(linear) else min(count, len(linear))
    found = linear.modes(most, False if undamped else None)
    asked.show(found)
    if asked.answered(found):
        return
    _print_assessment(found)
    units = ["Hz>", "rad/s>"] if found.undamped else ["damped Hz>", "undamped rad/s>"]
    head = ["mode>", *units, "damping>", "moves most", "kinetic energy"]
    carried = found.first(_ROWS).kinetic()
    rows = [
        [str(k + 1), f"{found.frequency[k]:.6g}", f"{found.omega[k]:.6g}",
         f"{found.damping[k]:.4g}", ", ".join(found.moving(k)[:_NAMED]), _most(carried, k)]
        for k in range(min(_ROWS, len(found)))
    ]  # fmt: skip
    terminal.console().print(terminal.table("", head, rows))
    if len(found) > _ROWS:
        terminal.say(f"and {len(found) - _ROWS} more: --count N, or --output FILE.csv")
    if not found.undamped and len(found):
        terminal.say(
            "damped: frequency of the oscillation, |Im s|/(2 pi); undamped: |s| of eigenvalue s"
        )
    terminal.say(_counted(found) if len(found) else "this scene has no degrees of freedom")
    if found.frame == "rotating":
        terminal.say("frequencies are those of the rotating frame")
    asked.say_where("")


def frf(
    scene: SceneFile,
    inputs: Annotated[
        list[str] | None,
        typer.Option("--input", "-i", metavar="NAME", help="Input, such as shoulder.effort, "
                     "boom.tip.force.x, ground.acceleration.y, road.displacement of a drive, or a "
                     "scene input; repeatable.  Default: the scene's inputs, else ground "
                     "accelerations."),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option("--quantity", "-q", metavar="NAME", help="Output, such as shoulder.angle, "
                     "boom.tip.position.y, boom.tip.ay, strut.length, or a scene output; "
                     "repeatable.  Default: the scene's outputs, else all coordinates."),
    ] = None,
    least: Annotated[
        float, typer.Option("--from", metavar="HZ", parser=positive, help="Lowest frequency, Hz.")
    ] = 0.1,
    most: Annotated[
        float, typer.Option("--to", metavar="HZ", parser=positive, help="Highest frequency, Hz.")
    ] = 100.0,
    points: Annotated[
        int, typer.Option("--points", metavar="N", parser=at_least(2), help="Number of "
                          "frequencies, logarithmically spaced.")
    ] = 201,
    structural: Annotated[
        list[str] | None,
        typer.Option("--structural", metavar="ETA", help="Structural loss factor, of all elastic "
                     "elements or of one: boom=0.02; repeatable."),
    ] = None,
    modal: Annotated[
        list[float] | None,
        typer.Option("--modal", metavar="RATIO", help="Modal damping ratio of all modes; repeated: "
                     "of the first, second, ... mode."),
    ] = None,
    exact: Annotated[
        list[str] | None,
        typer.Option("--exact", metavar="BEAM", help="Beam to be modelled by its exact dynamic "
                     'stiffness; "all" for every beam; repeatable.'),
    ] = None,
    friction: Friction = None,
    at_start: AtStart = False,
    change: Set = None,
    output: Output = None,
    plot: Plot = None,
    hinge: Elements = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Compute frequency response functions about the static equilibrium."""
    import numpy as np

    from mstmm.runtime.linear.harmonic.peaks import find_peaks

    from .. import output as terminal

    if not most > least:
        raise MstmmError(f"--from {least:g} --to {most:g}: expected --to above --from")
    asked = Asked(scene, at_start, change, output, plot, hinge, json, friction)
    linear = asked.linear(None)
    omega = 2 * np.pi * np.geomspace(least, most, points)
    ratios: list[float] = modal or [0.0]
    losses = number_or_named("--structural", structural or [], "boom=0.02") or 0.0
    answer = partial(
        linear.frequency_response, inputs=inputs or None, outputs=outputs or None,
        structural=losses, modal=ratios[0] if len(ratios) == 1 else ratios,
        exact=True if exact == ["all"] else exact or False,
    )  # fmt: skip
    found = answer(omega)
    if asked.answered(found):
        return
    _print_assessment(found)
    near = linear.modes().eigenvalues if len(linear) <= _ALL_MOTIONS and not exact else np.zeros(0)
    if losses or any(ratios):
        near = near - _SOME_DAMPING * np.abs(near)
    peaks = find_peaks(answer, found, np.asarray(near, dtype=np.complex128), _ROWS)
    pairs = [(i, j) for i in range(len(found.outputs)) for j in range(len(found.inputs))]
    rows = []
    for (i, j), size, at in zip(pairs, *peaks, strict=False):
        unit = f"{found.output_units[i]} / {found.input_units[j]}"
        shown = f"{size:.4g} {unit}" if np.isfinite(size) else f"unbounded {unit}, undamped"
        rows.append([found.outputs[i], found.inputs[j], shown, f"{at / (2 * np.pi):.5g}"])
    terminal.console().print(terminal.table("", ["output", "input", "peak>", "at Hz>"], rows))
    if len(pairs) > _ROWS:
        terminal.say(f"and {len(pairs) - _ROWS} more")
    asked.say_where("all values: --output FILE.csv or .nc, --plot FILE.png or --json")


def _print_assessment(answer: Assessed) -> None:
    """Print the verdict on an answer and its warnings."""
    from .. import output as terminal

    terminal.say(answer.verdict)
    for text in answer.warnings:
        terminal.note(f"warning: {text}")


def _most(shares: dict[str, Array], k: int) -> str:
    """Owners of the largest energy shares of mode k."""
    largest = sorted(shares, key=lambda name: -float(shares[name][k]))[:_OWNERS]
    return ", ".join(f"{name} {float(shares[name][k]):.0%}" for name in largest)


def _counted(found: Modes) -> str:
    if found.complete is None:
        return "completeness below the last mode not checked: damping or follower loads"
    if found.complete:
        return "all modes below the last one are found (checked by count)"
    return "modes below the last one are missing; request more: --count N"
