"""What the commands' arguments have in common: numbers with limits, output files, `--json`."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.arguments import number_in
from mstmm.errors import EnvironmentFailure, MstmmError, SceneError

if TYPE_CHECKING:
    from mstmm.scene import Scene

#: Most samples of one run.
MAX_SAMPLES = 10_000_000

json_text = typer.Option("--json", help="Print one JSON document instead of text.")
Json = Annotated[bool, json_text]


def quoted(text: Any) -> str:
    """The user's own words in a message, cut where they are long."""
    shown = repr(text)
    return shown if len(shown) <= 60 else shown[:57] + "..."


def finite(text: Any) -> float:
    """A finite number."""
    try:
        value = number_in(text)
    except (TypeError, ValueError):
        raise typer.BadParameter(f"{quoted(text)} is not a number") from None
    if not math.isfinite(value):
        raise typer.BadParameter(f"{quoted(text)} is not a finite number")
    return value


def positive(text: Any) -> float:
    """A finite number above 0."""
    value = finite(text)
    if value <= 0:
        raise typer.BadParameter(f"{quoted(text)}: expected a number above 0")
    return value


def not_negative(text: Any) -> float:
    """A finite number, 0 or more."""
    value = finite(text)
    if value < 0:
        raise typer.BadParameter(f"{quoted(text)}: expected 0 or more")
    return value


def at_least(least: int) -> Callable[[Any], int]:
    """A parser of whole numbers from `least` up."""

    def whole(text: Any) -> int:
        try:
            value = int(text)
        except (TypeError, ValueError):
            raise typer.BadParameter(f"{quoted(text)} is not a whole number") from None
        if value < least:
            raise typer.BadParameter(f"{quoted(text)}: expected a whole number, {least} or more")
        return value

    return whole


@dataclass(frozen=True)
class Times:
    """Times of the samples: `count` of them evenly from start to end, or one every `spacing` s."""

    count: int | None = None
    spacing: float | None = None

    def until(self, t_end: float) -> list[float]:
        """The times, s, the end included."""
        if self.count is not None:
            return [t_end * i / (self.count - 1) for i in range(self.count)]
        assert self.spacing is not None
        if t_end / self.spacing > MAX_SAMPLES:
            raise MstmmError(
                f"--times {self.spacing:g} asks for {t_end / self.spacing:.3g} samples, at most "
                f"{MAX_SAMPLES} can be had; take a wider spacing"
            )
        whole = int(t_end / self.spacing * (1 + 1e-12))
        times = [self.spacing * i for i in range(whole + 1)]
        if times[-1] >= t_end * (1 - 1e-12):
            times[-1] = t_end
        else:
            times.append(t_end)
        return times


def times(text: Any) -> Times:
    """`201` is a number of samples; `0.05`, `2.0` or `2s` is a spacing in s."""
    if isinstance(text, Times):
        return text
    if str(text).isdecimal():
        digits = str(text).lstrip("0")
        if len(digits) > 8 or int(digits or 0) > MAX_SAMPLES:
            raise typer.BadParameter(f"{quoted(text)}: at most {MAX_SAMPLES} samples can be had")
        if int(digits or 0) < 2:
            raise typer.BadParameter(
                f"{quoted(text)}: expected 2 samples or more, or a spacing in s such as 0.01 or 1s"
            )
        return Times(count=int(digits))
    try:
        return Times(spacing=positive(str(text).removesuffix("s")))
    except typer.BadParameter:
        raise typer.BadParameter(
            f"{quoted(text)}: expected a number of samples (201) or a spacing in s (0.05, 1s)"
        ) from None


def with_inputs(scene: Scene, texts: Sequence[str]) -> Scene:
    """The scene with inputs as in "motor=3".  MstmmError for what is none, SceneError for what the
    scene does not have."""
    from mstmm.runtime.engine import given as inputs

    values: dict[str, float | str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise MstmmError(
                f"--input {text}: expected NAME=VALUE, such as motor=3 or the name of a signal"
            )
        if name in values:
            raise MstmmError(f"--input {text}: {name} is given twice; give it once")
        values[name] = _number_or_name(value)
    try:
        return inputs.with_inputs(scene, values)
    except SceneError as error:
        lines = str(error).replace("scene with these inputs: ", "").splitlines()
        raise SceneError("\n".join(f"--input: {line}" for line in lines)) from None


def _number_or_name(text: str) -> float | str:
    try:
        return number_in(text)
    except ValueError:
        return text


def new_file(given: str | None, beside: str, ending: str) -> Path:
    """What `output_file` makes of a name; where none is given, that of the file `beside` with the
    ending, here, which nothing is written over: it may be somebody's work."""
    if given is not None:
        return output_file(given, (ending,))
    path = output_file(Path(beside).stem + ending, (ending,))
    if os.path.lexists(path):
        raise MstmmError(
            f"{path} is there already; name another with --output, or this one to write it anew"
        )
    return path


def output_file(text: str, endings: Sequence[str], option: str = "--output") -> Path:
    """A file that can be written, checked before anything is computed.

    Raises MstmmError for a wrong ending, a folder, or a folder that does not exist, and
    EnvironmentFailure where writing is not allowed.
    """
    if not text or "\0" in text:
        raise MstmmError(f"{option}: expected a file name, found {quoted(text)}")
    path = Path(text)
    if endings and path.suffix.lower() not in endings:
        raise MstmmError(f"{option} {text}: expected a name ending in {' or '.join(endings)}")
    try:
        if path.is_dir():
            raise MstmmError(f"{option} {text}: this is a folder; name a file inside it")
        if not path.parent.is_dir():
            raise MstmmError(f"{option} {text}: there is no folder {path.parent}; create it first")
        if path.exists() and not path.is_file():
            raise MstmmError(f"{option} {text}: this is not a regular file")
        size = max(len(os.fsencode(path.name)), 1)
    except (OSError, ValueError) as error:
        raise MstmmError(f"{option} {text}: {getattr(error, 'strerror', None) or error}") from None
    if size > 200:
        raise MstmmError(f"{option} {text[:40]}...: the name is too long; take a shorter one")
    if path.exists() and not os.access(path, os.W_OK):
        raise EnvironmentFailure(f"{option} {text}: it is write-protected; take another name")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            return path
    except OSError as error:
        raise EnvironmentFailure(
            f"{option} {text}: nothing can be written there ({error.strerror}); take another place"
        ) from None


def output_folder(text: str, file: str, option: str = "--out") -> Path:
    """A folder, made with its parents, in which `file` can be written: before anything is computed.

    Raises MstmmError for something else of that name, EnvironmentFailure where nothing can be
    written.
    """
    if not text or "\0" in text:
        raise MstmmError(f"{option}: expected the name of a folder, found {quoted(text)}")
    path = Path(text)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise MstmmError(f"{option} {text}: this is not a folder; take another name") from None
    except OSError as error:
        raise EnvironmentFailure(
            f"{option} {text}: the folder cannot be made ({error.strerror}); take another place"
        ) from None
    output_file(str(path / file), (), option)
    return path


def python_file(path: str) -> str:
    """A Python file that is there.  MstmmError for anything else."""
    if not path.endswith(".py"):
        raise MstmmError(f"{quoted(path)}: expected a Python file (.py) that defines elements")
    if "\0" in path or not os.path.isfile(path):
        raise MstmmError(f"{quoted(path)}: there is no such Python file; check the path")
    return path


#: Options that several commands have.
Elements = Annotated[
    list[str] | None,
    typer.Option("--hinge", metavar="FILE", help="Python file with an element of your own; may "
                 "be repeated. The file is executed."),
]  # fmt: skip
Budget = Annotated[
    float,
    typer.Option("--budget", metavar="SECONDS", parser=positive, help="Time that the runs may "
                 "take, s of the clock."),
]  # fmt: skip
Rounds = Annotated[
    int,
    typer.Option("--rounds", metavar="N", parser=at_least(0), help="How often times are taken "
                 "again."),
]  # fmt: skip
