"""Options common to `mstmm linearize`, `mstmm modes` and `mstmm frf`, and their output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.argument_validation import parse_number
from mstmm.errors import MstmmError

from ..extra_checks import require_extra_for
from ..graphics.view import VIEW_ENDINGS, title_from_path
from ..model_loading import compile_file, generate_elements
from ..options import output_file

if TYPE_CHECKING:
    from mstmm.runtime.linear.frequency_response import FrequencyResponse
    from mstmm.runtime.linear.linear_model import Linear
    from mstmm.runtime.linear.modes import Modes
    from mstmm.runtime.model.model import Model

SceneFile = Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")]
AtStart = Annotated[
    bool,
    typer.Option("--at-start", help="Linearise about the initial state, with its speeds, instead "
                 "of the equilibrium."),
]  # fmt: skip
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Change a scene parameter, such as "
                 "rod1.mass=2; repeatable."),
]  # fmt: skip
Output = Annotated[
    str | None,
    typer.Option("--output", "-o", metavar="FILE", help="File for the numerical results, .nc or "
                 ".csv."),
]  # fmt: skip
Plot = Annotated[
    str | None,
    typer.Option("--plot", metavar="FILE", help="Plot file: .png, .svg or .pdf."),
]  # fmt: skip
Friction = Annotated[
    list[str] | None,
    typer.Option("--friction", metavar="SPEED", help="Speed amplitude, rad/s or m/s, at which dry "
                 "friction is replaced by viscous damping, of all hinges or of one: elbow=0.1; "
                 "repeatable.  Default: no dry friction."),
]  # fmt: skip
_FILE_ENDINGS, _PLOT_ENDINGS = (".nc", ".csv"), (".png", ".svg", ".pdf")


@dataclass(frozen=True)
class LinearOptions:
    """Options of all three commands."""

    scene: str
    at_start: bool
    change: list[str] | None
    output: str | None
    plot: str | None
    hinge: list[str] | None
    json: bool
    friction: list[str] | None = None
    animation_path: str | None = None  #: only for modes: file of their animation

    def linear(self, inputs: list[str] | None) -> Linear:
        """Linearise the scene, after a check of all output files."""
        self._file()
        self._picture()
        _output_path(self.animation_path, VIEW_ENDINGS, "--view")
        generate_elements(self.hinge or [])
        model = _compile_changed(self.scene, self.change or [])
        state = model.initial_state() if self.at_start else (None, None)
        friction = parse_number_or_mapping("--friction", self.friction or [], "elbow=0.1")
        return model.linearize(*state, inputs=inputs or None, friction=friction)

    def _file(self) -> Path | None:
        return _output_path(self.output, _FILE_ENDINGS, "--output")

    def _picture(self) -> Path | None:
        return _output_path(self.plot, _PLOT_ENDINGS, "--plot")

    def write_animation(self, modes: Modes) -> None:
        """Write the animation of the modes, if a file is given."""
        if self.animation_path is not None:
            modes.view(self.animation_path, title=title_from_path(Path(self.scene)))

    def write_answer(self, answer: Linear | Modes | FrequencyResponse) -> bool:
        """Write the files, and with --json print the answer; True if it has been printed."""
        from .. import terminal_output as terminal

        file, picture = self._file(), self._picture()
        if file is not None:
            answer.save(file)
        if picture is not None:
            answer.plot(picture)
        if self.json:
            files = {"file": self.output, "plot": self.plot}
            if self.animation_path is not None:
                files["view"] = self.animation_path
            terminal.print_json({"scene": self.scene, **answer.to_dict(), **files})
        return self.json

    def print_file_names(self, other: str) -> None:
        """Print the names of the files written; without result file and plot, print `other`."""
        from .. import terminal_output as terminal

        if self.output is not None:
            terminal.print_lines(f"wrote {self.output}")
        if self.plot is not None:
            terminal.print_lines(f"wrote {self.plot}")
        if self.animation_path is not None:
            terminal.print_lines(f"wrote {self.animation_path}")
        if other and self.output is None and self.plot is None:
            terminal.print_lines(other)


def _output_path(name: str | None, endings: tuple[str, ...], option: str) -> Path | None:
    if name is None:
        return None
    path = output_file(name, endings, option)
    require_extra_for(path, option)
    return path


def _compile_changed(scene: str, changes: list[str]) -> Model:
    """Compile the scene with changed parameters."""
    import mstmm

    numbers = parse_assignments("--set", changes, "rod1.mass=2")
    model = compile_file(scene, mstmm.load_scene(scene), engine="looped")
    return model.with_parameters(numbers) if numbers else model


def parse_number_or_mapping(
    option: str, texts: Sequence[str], example: str
) -> float | dict[str, float] | None:
    """Parse one number for all, or numbers by name; None if nothing is given."""
    if len(texts) == 1 and "=" not in texts[0]:
        try:
            return float(texts[0])
        except ValueError:
            pass
    return parse_assignments(option, texts, example) or None


def parse_assignments(option: str, texts: Sequence[str], example: str) -> dict[str, float]:
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
