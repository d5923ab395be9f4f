"""`mstmm linearize`, `mstmm modes` and `mstmm frf`: linear models about an operating point."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.errors import MstmmError

from ..options import Elements, Json, integer_parser, parse_positive
from .linear_options import (
    AtStart,
    Friction,
    LinearOptions,
    Output,
    Plot,
    SceneFile,
    Set,
    parse_number_or_mapping,
)

if TYPE_CHECKING:
    from mstmm.array_validation import Array
    from mstmm.risk import AssessedResult
    from mstmm.runtime.linear.linear_model import Linear
    from mstmm.runtime.linear.modes import Modes

#: Rows of tables on the terminal; coordinates and bodies named in the row of a mode.
_MAX_ROWS, _MAX_NAMED, _MAX_OWNERS = 20, 3, 2
#: Largest entry of A that counts as rounding, relative to the largest entry.
_MAX_ROUNDING = 1e-12
#: Largest number of coordinates for a search of peaks near all modes; damping ratio assumed then.
_MAX_MODE_SEARCH, _ASSUMED_DAMPING = 400, 1e-6


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
    from .. import terminal_output as terminal

    options = LinearOptions(scene, at_start, change, output, plot, hinge, json, friction)
    linear = options.linear(inputs)
    if options.write_answer(linear):
        return
    _print_assessment(linear)
    terminal.print_lines(
        f"coordinates {len(linear)}, inputs {len(linear.input_names)}, "
        f"disturbances {len(linear.disturbance_names)}"
    )
    head, rows = _table_rows(linear)
    terminal.table_console().print(terminal.build_table("", head, rows[:_MAX_ROWS]))
    if len(rows) > _MAX_ROWS:
        terminal.print_lines(f"and {len(rows) - _MAX_ROWS} more")
    options.print_file_names("all matrices: --output FILE.csv or .nc, or --json")


def _table_rows(linear: Linear) -> tuple[list[str], list[list[str]]]:
    """Header and rows: diagonals of M, C, K; for a first-order model the largest entry per row."""
    if linear.has_stiffness:
        diagonals = (matrix.diagonal() for matrix in (linear.M, linear.C, linear.K))
        numbers = ([f"{x:.5g}" for x in row] for row in zip(*diagonals, strict=True))
        rows = [[name, *row] for name, row in zip(linear.coordinate_names, numbers, strict=True)]
        return ["coordinate", "M>", "C>", "K (diagonals)>"], rows
    rows, rounding = [], _MAX_ROUNDING * abs(linear.A).max(initial=0.0)
    for name, row in zip(linear.state_names, linear.A, strict=True):
        largest = (-abs(row)).argsort(kind="stable")[:_MAX_NAMED]
        columns = [k for k in largest if abs(row[k]) > rounding]
        rows.append([name, ", ".join(f"{row[k]:.5g} {linear.state_names[k]}" for k in columns)])
    return ["state", "rate (largest entries of A)"], rows


def modes(
    scene: SceneFile,
    count: Annotated[
        int | None,
        typer.Option(
            "--count",
            "-n",
            metavar="N",
            parser=integer_parser(1),
            help="Number of lowest modes; default: all.",
        ),
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
        typer.Option(
            "--view",
            metavar="FILE",
            help="Animate the modes: .html, strip (.png, .svg, .pdf) or film (.gif, .mp4).",
        ),
    ] = None,
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Compute normal modes about the static equilibrium: frequencies, damping ratios, shapes."""
    from .. import terminal_output as terminal

    options = LinearOptions(scene, at_start, change, output, plot, hinge, json, friction, seen)
    linear = options.linear(None)
    max_count = None if count is None or not len(linear) else min(count, len(linear))
    result = linear.modes(max_count, False if undamped else None)
    options.write_animation(result)
    if options.write_answer(result):
        return
    _print_assessment(result)
    units = ["Hz>", "rad/s>"] if result.is_undamped else ["damped Hz>", "undamped rad/s>"]
    head = ["mode>", *units, "damping>", "moves most", "kinetic energy"]
    energy_shares = result.lowest(_MAX_ROWS).kinetic_energy_shares()
    rows = [
        [
            str(k + 1),
            f"{result.frequency[k]:.6g}",
            f"{result.omega[k]:.6g}",
            f"{result.damping_ratio[k]:.4g}",
            ", ".join(result.dominant_coordinates(k)[:_MAX_NAMED]),
            _largest_owners(energy_shares, k),
        ]
        for k in range(min(_MAX_ROWS, len(result)))
    ]
    terminal.table_console().print(terminal.build_table("", head, rows))
    if len(result) > _MAX_ROWS:
        terminal.print_lines(f"and {len(result) - _MAX_ROWS} more: --count N, or --output FILE.csv")
    if not result.is_undamped and len(result):
        terminal.print_lines(
            "damped: frequency of the oscillation, |Im s|/(2 pi); undamped: |s| of eigenvalue s"
        )
    terminal.print_lines(
        _completeness_text(result) if len(result) else "this scene has no degrees of freedom"
    )
    if result.frame == "rotating":
        terminal.print_lines("frequencies are those of the rotating frame")
    options.print_file_names("")


def frf(
    scene: SceneFile,
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            "-i",
            metavar="NAME",
            help="Input, such as shoulder.effort, "
            "boom.tip.force.x, ground.acceleration.y, road.displacement of a drive, or a "
            "scene input; repeatable.  Default: the scene's inputs, else ground accelerations.",
        ),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            "--quantity",
            "-q",
            metavar="NAME",
            help="Output, such as shoulder.angle, "
            "boom.tip.position.y, boom.tip.ay, strut.length, or a scene output; "
            "repeatable.  Default: the scene's outputs, else all coordinates.",
        ),
    ] = None,
    least: Annotated[
        float,
        typer.Option("--from", metavar="HZ", parser=parse_positive, help="Lowest frequency, Hz."),
    ] = 0.1,
    most: Annotated[
        float,
        typer.Option("--to", metavar="HZ", parser=parse_positive, help="Highest frequency, Hz."),
    ] = 100.0,
    points: Annotated[
        int,
        typer.Option(
            "--points",
            metavar="N",
            parser=integer_parser(2),
            help="Number of frequencies, logarithmically spaced.",
        ),
    ] = 201,
    structural: Annotated[
        list[str] | None,
        typer.Option(
            "--structural",
            metavar="ETA",
            help="Structural loss factor, of all elastic "
            "elements or of one: boom=0.02; repeatable.",
        ),
    ] = None,
    modal: Annotated[
        list[float] | None,
        typer.Option(
            "--modal",
            metavar="RATIO",
            help="Modal damping ratio of all modes; repeated: of the first, second, ... mode.",
        ),
    ] = None,
    exact: Annotated[
        list[str] | None,
        typer.Option(
            "--exact",
            metavar="BEAM",
            help="Beam to be modelled by its exact dynamic "
            'stiffness; "all" for every beam; repeatable.',
        ),
    ] = None,
    friction: Friction = None,
    at_start: AtStart = False,
    change: Set = None,
    output: Output = None,
    plot: Plot = None,
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Compute frequency response functions about the static equilibrium."""
    import numpy as np

    from mstmm.runtime.linear.harmonic.peaks import find_peaks

    from .. import terminal_output as terminal

    if not most > least:
        raise MstmmError(f"--from {least:g} --to {most:g}: expected --to above --from")
    options = LinearOptions(scene, at_start, change, output, plot, hinge, json, friction)
    linear = options.linear(None)
    omega = 2 * np.pi * np.geomspace(least, most, points)
    ratios: list[float] = modal or [0.0]
    losses = parse_number_or_mapping("--structural", structural or [], "boom=0.02") or 0.0
    evaluate = partial(
        linear.frequency_response, inputs=inputs or None, outputs=outputs or None,
        structural=losses, modal=ratios[0] if len(ratios) == 1 else ratios,
        exact=True if exact == ["all"] else exact or False,
    )  # fmt: skip
    response = evaluate(omega)
    if options.write_answer(response):
        return
    _print_assessment(response)
    eigenvalues = (
        linear.modes().eigenvalues if len(linear) <= _MAX_MODE_SEARCH and not exact else np.zeros(0)
    )
    if losses or any(ratios):
        eigenvalues = eigenvalues - _ASSUMED_DAMPING * np.abs(eigenvalues)
    peaks = find_peaks(evaluate, response, np.asarray(eigenvalues, dtype=np.complex128), _MAX_ROWS)
    pairs = [
        (i, j) for i in range(len(response.output_names)) for j in range(len(response.input_names))
    ]
    rows = []
    for (i, j), size, peak_omega in zip(pairs, *peaks, strict=False):
        unit = f"{response.output_units[i]} / {response.input_units[j]}"
        peak_text = f"{size:.4g} {unit}" if np.isfinite(size) else f"unbounded {unit}, undamped"
        rows.append(
            [
                response.output_names[i],
                response.input_names[j],
                peak_text,
                f"{peak_omega / (2 * np.pi):.5g}",
            ]
        )
    terminal.table_console().print(
        terminal.build_table("", ["output", "input", "peak>", "at Hz>"], rows)
    )
    if len(pairs) > _MAX_ROWS:
        terminal.print_lines(f"and {len(pairs) - _MAX_ROWS} more")
    options.print_file_names("all values: --output FILE.csv or .nc, --plot FILE.png or --json")


def _print_assessment(answer: AssessedResult) -> None:
    """Print the verdict on an answer and its warnings."""
    from .. import terminal_output as terminal

    terminal.print_lines(answer.verdict())
    for text in answer.warnings:
        terminal.print_note(f"warning: {text}")


def _largest_owners(shares: dict[str, Array], k: int) -> str:
    """Owners of the largest energy shares of mode k."""
    largest = sorted(shares, key=lambda name: -float(shares[name][k]))[:_MAX_OWNERS]
    return ", ".join(f"{name} {float(shares[name][k]):.0%}" for name in largest)


def _completeness_text(found: Modes) -> str:
    if found.is_complete is None:
        return "completeness below the last mode not checked: damping or follower loads"
    if found.is_complete:
        return "all modes below the last one are found (checked by count)"
    return "modes below the last one are missing; request more: --count N"
