"""What `mstmm linearize`, `mstmm modes` and `mstmm frf` have in common: where a scene is made
linear, and what becomes of the answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.arguments import number_in
from mstmm.errors import MstmmError

from ..extras import need_for
from ..models import compiled, use_files
from ..options import output_file
from ..pictures.view import ENDINGS, title_of

if TYPE_CHECKING:
    from mstmm.runtime.linear.linear import Linear
    from mstmm.runtime.linear.motions import Modes
    from mstmm.runtime.linear.response import FrequencyResponse
    from mstmm.runtime.model.model import Model

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
Plot = Annotated[
    str | None,
    typer.Option("--plot", metavar="FILE", help="A picture of it: .png, .svg or .pdf."),
]  # fmt: skip
Friction = Annotated[
    list[str] | None,
    typer.Option("--friction", metavar="SPEED", help="Amplitude of speed, rad/s or m/s, at which "
                 "dry friction counts as viscous damping, or of a hinge or chain: elbow=0.1; may "
                 "be repeated.  Left out unless given."),
]  # fmt: skip
_FILES, _PICTURES = (".nc", ".csv"), (".png", ".svg", ".pdf")


@dataclass(frozen=True)
class Asked:
    """The options that all three commands take."""

    scene: str
    at_start: bool
    change: list[str] | None
    output: str | None
    plot: str | None
    hinge: list[str] | None
    json: bool
    friction: list[str] | None = None
    seen: str | None = None  #: of modes alone: where they are shown as they move

    def linear(self, inputs: list[str] | None) -> Linear:
        """The scene made linear; before that every file that it will write is checked."""
        self._file()
        self._picture()
        _checked(self.seen, ENDINGS, "--view")
        use_files(self.hinge or [])
        model = _changed(self.scene, self.change or [])
        state = model.initial_state() if self.at_start else (None, None)
        friction = number_or_named("--friction", self.friction or [], "elbow=0.1")
        return model.linearize(*state, inputs=inputs or None, friction=friction)

    def _file(self) -> Path | None:
        return _checked(self.output, _FILES, "--output")

    def _picture(self) -> Path | None:
        return _checked(self.plot, _PICTURES, "--plot")

    def show(self, modes: Modes) -> None:
        """The motions as they move, into the file that is named."""
        if self.seen is not None:
            modes.view(self.seen, title=title_of(Path(self.scene)))

    def answered(self, answer: Linear | Modes | FrequencyResponse) -> bool:
        """The files written; with --json the answer told, and nothing is left to say."""
        from .. import output as terminal

        file, picture = self._file(), self._picture()
        if file is not None:
            answer.save(file)
        if picture is not None:
            answer.plot(picture)
        if self.json:
            files = {"file": self.output, "plot": self.plot}
            if self.seen is not None:
                files["view"] = self.seen
            terminal.emit_json({"scene": self.scene, **answer.to_dict(), **files})
        return self.json

    def say_where(self, other: str) -> None:
        """Names of the files; without any, `other`."""
        from .. import output as terminal

        if self.output is not None:
            terminal.say(f"written: {self.output}")
        if self.plot is not None:
            terminal.say(f"drawn: {self.plot}")
        if self.seen is not None:
            terminal.say(f"shown: {self.seen}")
        if other and self.output is None and self.plot is None:
            terminal.say(other)


def _checked(name: str | None, endings: tuple[str, ...], option: str) -> Path | None:
    if name is None:
        return None
    path = output_file(name, endings, option)
    need_for(path, option)
    return path


def _changed(scene: str, changes: list[str]) -> Model:
    """The scene compiled, with other numbers."""
    import mstmm

    numbers = assigned("--set", changes, "rod1.mass=2")
    model = compiled(scene, mstmm.load_scene(scene), engine="looped")
    return model.with_parameters(numbers) if numbers else model


def number_or_named(
    option: str, texts: Sequence[str], example: str
) -> float | dict[str, float] | None:
    """One number for all, or numbers by names; None where nothing is given."""
    if len(texts) == 1 and "=" not in texts[0]:
        try:
            return float(texts[0])
        except ValueError:
            pass
    return assigned(option, texts, example) or None


def assigned(option: str, texts: Sequence[str], example: str) -> dict[str, float]:
    """The numbers of each NAME=VALUE by their names, each of which may come once."""
    found: dict[str, float] = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        if name in found:
            raise MstmmError(
                f"{option} {text}: {name} is set to {found[name]:g} already; set each number once"
            )
        try:
            found[name] = number_in(value)
        except ValueError:
            message = f'{option} {text}: expected NAME=VALUE, such as "{example}"'
            raise MstmmError(message) from None
    return found
