"""`mstmm linearize`, `mstmm modes` and `mstmm frf`: linear models about an operating point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from mstmm.argument_validation import parse_number
from mstmm.errors import MstmmError

from .model_loading import compile_file, generate_elements
from .options import (
    PLOT_ENDINGS,
    VIEW_ENDINGS,
    Elements,
    Json,
    Plot,
    SceneFile,
    flag,
    integer_parser,
    option,
    output_file,
    parse_positive,
    require_extra_for,
    title_from_path,
)
from .terminal_output import build_table, print_json, print_lines, print_note, table_console

if TYPE_CHECKING:
    from mstmm.array_validation import Array
    from mstmm.risk import AssessedResult
    from mstmm.runtime.linear.frequency_response import FrequencyResponse
    from mstmm.runtime.linear.linear_model import Linear
    from mstmm.runtime.linear.modes import Modes
    from mstmm.runtime.model.model import Model

#: Rows of tables on the terminal; coordinates and bodies named in the row of a mode.
_MAX_ROWS, _MAX_NAMED, _MAX_OWNERS = 20, 3, 2
#: Largest entry of A that counts as rounding, relative to the largest entry.
_MAX_ROUNDING = 1e-12
#: Largest number of coordinates for a search of peaks near all modes; damping ratio assumed then.
_MAX_MODE_SEARCH, _ASSUMED_DAMPING = 400, 1e-6

_FRICTION_HELP = (
    "Speed amplitude, rad/s or m/s, at which dry friction is replaced by viscous damping, of all "
    "hinges or of one: elbow=0.1; repeatable.  Default: no dry friction."
)
_AT_START_HELP = "Linearise about the initial state, with its speeds, instead of the equilibrium."
_SET_HELP = "Change a scene parameter, such as rod1.mass=2; repeatable."
_INPUTS_HELP = (
    "Input, such as shoulder.effort, strut.effort, boom.tip.force.x, boom.tip.mz, or a scene "
    "input; repeatable.  Default: the scene's inputs."
)
_VIEW_HELP = "Animate the modes: .html, strip (.png, .svg, .pdf) or film (.gif, .mp4)."
_FRF_INPUTS_HELP = (
    "Input, such as shoulder.effort, boom.tip.force.x, ground.acceleration.y, road.displacement "
    "of a drive, or a scene input; repeatable.  Default: the scene's inputs, else ground "
    "accelerations."
)
_FRF_OUTPUTS_HELP = (
    "Output, such as shoulder.angle, boom.tip.position.y, boom.tip.ay, strut.length, or a scene "
    "output; repeatable.  Default: the scene's outputs, else all coordinates."
)
_LOSS_HELP = "Structural loss factor, of all elastic elements or of one: boom=0.02; repeatable."
_MODAL_HELP = "Modal damping ratio of all modes; repeated: of the first, second, ... mode."
_EXACT_HELP = (
    'Beam to be modelled by its exact dynamic stiffness; "all" for every beam; repeatable.'
)


@dataclass(frozen=True)
class LinearOptions:
    """Options common to all three commands."""

    friction: Annotated[list[str] | None, option("--friction", "SPEED", _FRICTION_HELP)] = None
    at_start: Annotated[bool, flag("--at-start", _AT_START_HELP)] = False
    change: Annotated[list[str] | None, option("--set", "NAME=VALUE", _SET_HELP)] = None
    output: Annotated[
        str | None, option("--output/-o", "FILE", "File for the numerical results, .nc or .csv.")
    ] = None
    plot: Plot = None

    def linear(
        self,
        scene: str,
        hinge: list[str] | None,
        inputs: list[str] | None = None,
        view: str | None = None,
    ) -> Linear:
        """Linearise the scene, after a check of all output files, also that of an animation."""
        self._file()
        self._picture()
        _output_path(view, VIEW_ENDINGS, "--view")
        generate_elements(hinge or [])
        model = _compile_changed(scene, self.change or [])
        state = model.initial_state() if self.at_start else (None, None)
        friction = _parse_number_or_mapping("--friction", self.friction or [], "elbow=0.1")
        return model.linearize(*state, inputs=inputs or None, friction=friction)

    def _file(self) -> Path | None:
        return _output_path(self.output, (".nc", ".csv"), "--output")

    def _picture(self) -> Path | None:
        return _output_path(self.plot, PLOT_ENDINGS, "--plot")

    def write_answer(
        self, scene: str, answer: Linear | Modes | FrequencyResponse, json: bool, **other: str
    ) -> bool:
        """Write the files, and with --json print the answer; True if it has been printed."""
        file, picture = self._file(), self._picture()
        if file is not None:
            answer.save(file)
        if picture is not None:
            answer.plot(picture)
        if json:
            files = {"file": self.output, "plot": self.plot, **other}
            print_json({"scene": scene, **answer.to_dict(), **files})
        return json

    def print_file_names(self, advice: str, *others: str) -> None:
        """Print the names of the files written; without result file and plot, print `advice`."""
        for name in (self.output, self.plot, *others):
            if name is not None:
                print_lines(f"wrote {name}")
        if advice and self.output is None and self.plot is None:
            print_lines(advice)


def _output_path(name: str | None, endings: tuple[str, ...], option: str) -> Path | None:
    if name is None:
        return None
    path = output_file(name, endings, option)
    require_extra_for(path, option)
    return path


def _compile_changed(scene: str, changes: list[str]) -> Model:
    """Compile the scene with changed parameters."""
    import mstmm

    numbers = _parse_assignments("--set", changes, "rod1.mass=2")
    model = compile_file(scene, mstmm.load_scene(scene), engine="looped")
    return model.with_parameters(numbers) if numbers else model


def _parse_number_or_mapping(
    option: str, texts: Sequence[str], example: str
) -> float | dict[str, float] | None:
    """Parse one number for all, or numbers by name; None if nothing is given."""
    if len(texts) == 1 and "=" not in texts[0]:
        try:
            return float(texts[0])
        except ValueError:
            pass
    return _parse_assignments(option, texts, example) or None


def _parse_assignments(option: str, texts: Sequence[str], example: str) -> dict[str, float]:
    """Parse texts NAME=VALUE to numbers by name; MstmmError for a repeated name."""
    numbers: dict[str, float] = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        if name in numbers:
            raise MstmmError(
                f"{option} {text}: {name} is set to {numbers[name]:g} already; set each number once"
            )
        try:
            numbers[name] = parse_number(value)
        except ValueError:
            message = f'{option} {text}: expected NAME=VALUE, such as "{example}"'
            raise MstmmError(message) from None
    return numbers


# --- linear model ---------------------------------------------------------------------------------


def linearize(
    scene: SceneFile,
    inputs: Annotated[list[str] | None, option("--input/-i", "NAME", _INPUTS_HELP)] = None,
    *,
    options: LinearOptions,
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Linearise a scene about its static equilibrium: M x'' + C x' + K x = V v + W w."""
    linear = options.linear(scene, hinge, inputs)
    if options.write_answer(scene, linear, json):
        return
    _print_assessment(linear)
    print_lines(
        f"coordinates {len(linear)}, inputs {len(linear.input_names)}, "
        f"disturbances {len(linear.disturbance_names)}"
    )
    head, rows = _table_rows(linear)
    table_console().print(build_table("", head, rows[:_MAX_ROWS]))
    if len(rows) > _MAX_ROWS:
        print_lines(f"and {len(rows) - _MAX_ROWS} more")
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


def _print_assessment(answer: AssessedResult) -> None:
    """Print the verdict on an answer and its warnings."""
    print_lines(answer.verdict())
    for text in answer.warnings:
        print_note(f"warning: {text}")


# --- modes ----------------------------------------------------------------------------------------


def modes(
    scene: SceneFile,
    count: Annotated[
        int | None,
        option("--count/-n", "N", "Number of lowest modes; default: all.", integer_parser(1)),
    ] = None,
    undamped: Annotated[bool, flag("--undamped", "Ignore damping and gyroscopic terms.")] = False,
    *,
    options: LinearOptions,
    seen: Annotated[str | None, option("--view", "FILE", _VIEW_HELP)] = None,
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Compute normal modes about the static equilibrium: frequencies, damping ratios, shapes."""
    linear = options.linear(scene, hinge, view=seen)
    max_count = None if count is None or not len(linear) else min(count, len(linear))
    result = linear.modes(max_count, False if undamped else None)
    view_file = {} if seen is None else {"view": seen}
    if seen is not None:
        result.view(seen, title=title_from_path(Path(scene)))
    if options.write_answer(scene, result, json, **view_file):
        return
    _print_modes(result)
    options.print_file_names("", *view_file.values())


def _print_modes(result: Modes) -> None:
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
    table_console().print(build_table("", head, rows))
    if len(result) > _MAX_ROWS:
        print_lines(f"and {len(result) - _MAX_ROWS} more: --count N, or --output FILE.csv")
    if not result.is_undamped and len(result):
        print_lines(
            "damped: frequency of the oscillation, |Im s|/(2 pi); undamped: |s| of eigenvalue s"
        )
    print_lines(
        _completeness_text(result) if len(result) else "this scene has no degrees of freedom"
    )
    if result.frame == "rotating":
        print_lines("frequencies are those of the rotating frame")


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


# --- frequency response ---------------------------------------------------------------------------


@dataclass(frozen=True)
class FrequencyOptions:
    """Options of a frequency response: inputs, outputs, frequencies, damping."""

    inputs: Annotated[list[str] | None, option("--input/-i", "NAME", _FRF_INPUTS_HELP)] = None
    outputs: Annotated[list[str] | None, option("--quantity/-q", "NAME", _FRF_OUTPUTS_HELP)] = None
    least: Annotated[float, option("--from", "HZ", "Lowest frequency, Hz.", parse_positive)] = 0.1
    most: Annotated[float, option("--to", "HZ", "Highest frequency, Hz.", parse_positive)] = 100.0
    points: Annotated[
        int,
        option(
            "--points", "N", "Number of frequencies, logarithmically spaced.", integer_parser(2)
        ),
    ] = 201
    structural: Annotated[list[str] | None, option("--structural", "ETA", _LOSS_HELP)] = None
    modal: Annotated[list[float] | None, option("--modal", "RATIO", _MODAL_HELP)] = None
    exact: Annotated[list[str] | None, option("--exact", "BEAM", _EXACT_HELP)] = None

    @property
    def damping(self) -> dict[str, Any]:
        """Structural loss factors and modal damping ratios."""
        losses = _parse_number_or_mapping("--structural", self.structural or [], "boom=0.02")
        ratios = self.modal or [0.0]
        return {"structural": losses or 0.0, "modal": ratios[0] if len(ratios) == 1 else ratios}

    def evaluator(self, linear: Linear) -> Callable[[Any], FrequencyResponse]:
        """Frequency response of a linear model as a function of the angular frequency."""
        return partial(
            linear.frequency_response, inputs=self.inputs or None, outputs=self.outputs or None,
            exact=True if self.exact == ["all"] else self.exact or False, **self.damping,
        )  # fmt: skip


def frf(
    scene: SceneFile,
    frequencies: FrequencyOptions,
    options: LinearOptions,
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Compute frequency response functions about the static equilibrium."""
    import numpy as np

    least, most = frequencies.least, frequencies.most
    if not most > least:
        raise MstmmError(f"--from {least:g} --to {most:g}: expected --to above --from")
    linear = options.linear(scene, hinge)
    evaluate = frequencies.evaluator(linear)
    response = evaluate(2 * np.pi * np.geomspace(least, most, frequencies.points))
    if options.write_answer(scene, response, json):
        return
    _print_assessment(response)
    _print_peaks(linear, frequencies, response, evaluate)
    options.print_file_names("all values: --output FILE.csv or .nc, --plot FILE.png or --json")


def _print_peaks(
    linear: Linear,
    frequencies: FrequencyOptions,
    response: FrequencyResponse,
    evaluate: Callable[[Any], FrequencyResponse],
) -> None:
    """Print the highest peak of each output and input, searched near the modes as well."""
    import numpy as np

    from mstmm.runtime.linear.harmonic.peaks import find_peaks

    is_searched = len(linear) <= _MAX_MODE_SEARCH and not frequencies.exact
    eigenvalues = linear.modes().eigenvalues if is_searched else np.zeros(0)
    if frequencies.damping["structural"] or any(frequencies.modal or ()):
        eigenvalues = eigenvalues - _ASSUMED_DAMPING * np.abs(eigenvalues)
    peaks = find_peaks(evaluate, response, np.asarray(eigenvalues, dtype=np.complex128), _MAX_ROWS)
    outputs = list(zip(response.output_names, response.output_units, strict=True))
    inputs = list(zip(response.input_names, response.input_units, strict=True))
    pairs = [(output, given) for output in outputs for given in inputs]
    rows = []
    for ((output, output_unit), (given, input_unit)), size, omega in zip(
        pairs, *peaks, strict=False
    ):
        unit = f"{output_unit} / {input_unit}"
        peak_text = f"{size:.4g} {unit}" if np.isfinite(size) else f"unbounded {unit}, undamped"
        rows.append([output, given, peak_text, f"{omega / (2 * np.pi):.5g}"])
    table_console().print(build_table("", ["output", "input", "peak>", "at Hz>"], rows))
    if len(pairs) > _MAX_ROWS:
        print_lines(f"and {len(pairs) - _MAX_ROWS} more")
