"""Declaration of the options of commands; parsers and options common to several of them."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from mstmm.argument_validation import parse_number
from mstmm.errors import EnvironmentFailure, MstmmError, SceneError
from mstmm.optional_packages import missing_packages

if TYPE_CHECKING:
    from mstmm.scene import Scene

#: Largest number of samples of a run.
MAX_SAMPLES = 10_000_000

#: Endings of files of results, plots and animations.
RESULT_ENDINGS = (".nc", ".csv", ".mat")
PLOT_ENDINGS = (".png", ".svg", ".pdf")
VIEW_ENDINGS = (".html", ".png", ".svg", ".pdf", ".gif", ".mp4")


def option(
    names: str,
    metavar: str,
    description: str,
    parser: Callable[[Any], Any] | None = None,
    **more: Any,
) -> Any:
    """Option such as "--step" or "--input/-i", with its value's name and its help text."""
    return typer.Option(*names.split("/"), metavar=metavar, help=description, parser=parser, **more)


def flag(names: str, description: str) -> Any:
    """Option without a value, such as "--json" or "--certify/--no-certify"."""
    return typer.Option(names, help=description)


def flat_options(run: Callable[..., None]) -> Callable[..., None]:
    """Command of a function, with one option for each field of a parameter that is a dataclass.

    A parameter stands for a dataclass by its annotation, or by a dataclass in `Annotated`.
    """
    groups: dict[str, Any] = {}
    parameters: list[Parameter] = []
    for parameter in _parameters_of(run, signature(run).parameters.values()):
        group = next(filter(is_dataclass, (parameter.annotation, *_metadata(parameter))), None)
        if group is None:
            parameters.append(parameter)
        else:
            groups[parameter.name] = group, _parameters_of(group, _option_fields(group))
            parameters += groups[parameter.name][1]

    def command(**values: Any) -> None:
        for name, (group, members) in groups.items():
            values[name] = group(**{member.name: values.pop(member.name) for member in members})
        run(**values)

    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    command.__doc__, command.__name__ = run.__doc__, run.__name__
    return command


def _metadata(parameter: Parameter) -> tuple[Any, ...]:
    return getattr(parameter.annotation, "__metadata__", ())


def _option_fields(group: Any) -> Iterator[Parameter]:
    """Fields of a dataclass that are options, as parameters."""
    for item in fields(group):
        if item.init and item.default_factory is MISSING:
            default = Parameter.empty if item.default is MISSING else item.default
            yield Parameter(item.name, Parameter.KEYWORD_ONLY, default=default)


def _parameters_of(owner: Any, given: Iterable[Parameter]) -> list[Parameter]:
    """Keyword parameters with evaluated annotations."""
    hints = get_type_hints(owner, include_extras=True)
    return [p.replace(kind=Parameter.KEYWORD_ONLY, annotation=hints[p.name]) for p in given]


def quote(text: Any) -> str:
    """Quote a text of the user in a message, shortened if it is long."""
    representation = repr(text)
    return representation if len(representation) <= 60 else representation[:57] + "..."


def parse_finite(text: Any) -> float:
    """Parse a finite number."""
    try:
        value = parse_number(text)
    except (TypeError, ValueError):
        raise typer.BadParameter(f"{quote(text)} is not a number") from None
    if not math.isfinite(value):
        raise typer.BadParameter(f"{quote(text)} is not a finite number")
    return value


def parse_positive(text: Any) -> float:
    """Parse a finite number above 0."""
    value = parse_finite(text)
    if value <= 0:
        raise typer.BadParameter(f"{quote(text)}: expected a number above 0")
    return value


def parse_not_negative(text: Any) -> float:
    """Parse a finite number, 0 or more."""
    value = parse_finite(text)
    if value < 0:
        raise typer.BadParameter(f"{quote(text)}: expected 0 or more")
    return value


def integer_parser(least: int) -> Callable[[Any], int]:
    """Parser of integers not below `least`."""

    def parse_integer(text: Any) -> int:
        try:
            value = int(text)
        except (TypeError, ValueError):
            raise typer.BadParameter(f"{quote(text)} is not a whole number") from None
        if value < least:
            raise typer.BadParameter(f"{quote(text)}: expected a whole number, {least} or more")
        return value

    return parse_integer


@dataclass(frozen=True)
class OutputTimes:
    """Output times of a run: `count` equidistant ones, or one every `spacing` s."""

    count: int | None = None
    spacing: float | None = None

    def until(self, t_end: float) -> list[float]:
        """Output times up to and including `t_end`, s.  MstmmError for too many."""
        if self.count is not None:
            return [t_end * i / (self.count - 1) for i in range(self.count)]
        assert self.spacing is not None
        if t_end / self.spacing > MAX_SAMPLES:
            raise MstmmError(
                f"--times {self.spacing:g}: expected at most {MAX_SAMPLES} samples, found "
                f"{t_end / self.spacing:.3g}; use a wider spacing"
            )
        interval_count = int(t_end / self.spacing * (1 + 1e-12))
        times = [self.spacing * i for i in range(interval_count + 1)]
        if times[-1] >= t_end * (1 - 1e-12):
            times[-1] = t_end
        else:
            times.append(t_end)
        return times


def parse_times(text: Any) -> OutputTimes:
    """Parse output times: `201` is a number of samples, `0.05`, `2.0` or `2s` a spacing in s."""
    if isinstance(text, OutputTimes):
        return text
    if str(text).isdecimal():
        digits = str(text).lstrip("0")
        if len(digits) > 8 or int(digits or 0) > MAX_SAMPLES:
            raise typer.BadParameter(f"{quote(text)}: expected at most {MAX_SAMPLES} samples")
        if int(digits or 0) < 2:
            raise typer.BadParameter(
                f"{quote(text)}: expected 2 samples or more, or a spacing in s such as 0.01 or 1s"
            )
        return OutputTimes(count=int(digits))
    try:
        return OutputTimes(spacing=parse_positive(str(text).removesuffix("s")))
    except typer.BadParameter:
        raise typer.BadParameter(
            f"{quote(text)}: expected a number of samples (201) or a spacing in s (0.05, 1s)"
        ) from None


def with_inputs(scene: Scene, texts: Sequence[str]) -> Scene:
    """Set inputs of a scene from texts such as "motor=3".

    MstmmError for an invalid text, SceneError for an input or signal that the scene does not have.
    """
    from mstmm.runtime.engine import inputs

    values: dict[str, float | str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise MstmmError(
                f"--input {text}: expected NAME=VALUE, such as motor=3 or the name of a signal"
            )
        if name in values:
            raise MstmmError(f"--input {text}: {name} is given twice; give it once")
        values[name] = _parse_number_or_name(value)
    try:
        return inputs.scene_with_inputs(scene, values)
    except SceneError as error:
        lines = str(error).replace("scene with these inputs: ", "").splitlines()
        raise SceneError("\n".join(f"--input: {line}" for line in lines)) from None


def _parse_number_or_name(text: str) -> float | str:
    try:
        return parse_number(text)
    except ValueError:
        return text


def new_file(given: str | None, beside: str, ending: str) -> Path:
    """Output file of the given name, or by default of the name of the file `beside`.

    The default is in the current folder and must not exist yet, so that no work is overwritten.
    Errors are those of `output_file`.
    """
    if given is not None:
        return output_file(given, (ending,))
    path = output_file(Path(beside).stem + ending, (ending,))
    if os.path.lexists(path):
        raise MstmmError(
            f"{path} exists already; give another name with --output, or this one to overwrite it"
        )
    return path


def output_file(text: str, endings: Sequence[str], option: str = "--output") -> Path:
    """Check that a file can be written, before anything is computed, and return its path.

    Raises MstmmError for a wrong ending, a folder, or a folder that does not exist, and
    EnvironmentFailure if writing is not allowed.
    """
    if not text or "\0" in text:
        raise MstmmError(f"{option}: expected a file name, found {quote(text)}")
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
        raise MstmmError(f"{option} {text[:40]}...: the name is too long; use a shorter one")
    if path.exists() and not os.access(path, os.W_OK):
        raise EnvironmentFailure(f"{option} {text}: it is write-protected; use another name")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            return path
    except OSError as error:
        raise EnvironmentFailure(
            f"{option} {text}: the folder is not writable ({error.strerror}); use another folder"
        ) from None


def output_folder(text: str, file: str, option: str = "--out") -> Path:
    """Create a folder with its parents, and check that `file` can be written in it.

    Raises MstmmError if the name is not a folder, EnvironmentFailure if it is not writable.
    """
    if not text or "\0" in text:
        raise MstmmError(f"{option}: expected the name of a folder, found {quote(text)}")
    path = Path(text)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise MstmmError(f"{option} {text}: this is not a folder; use another name") from None
    except OSError as error:
        raise EnvironmentFailure(
            f"{option} {text}: the folder cannot be created ({error.strerror}); use another one"
        ) from None
    output_file(str(path / file), (), option)
    return path


# --- optional packages ----------------------------------------------------------------------------

_EXTRA_BY_SUFFIX = {
    ".nc": "io", ".png": "plot", ".svg": "plot", ".pdf": "plot", ".gif": "plot", ".mp4": "plot",
    ".html": "view",
}  # fmt: skip


def install_command(extra: str) -> str:
    """Command that installs an extra."""
    return f"pip install 'mstmm[{extra}]'"


def missing_extra(what: str, extra: str) -> list[str]:
    """Line that names the missing packages of an extra, as a list; empty if there are none."""
    missing = missing_packages(extra)
    return [f"{what} {', '.join(missing)}: {install_command(extra)}"] if missing else []


def require_extra_for(path: Path, option: str) -> None:
    """Raise EnvironmentFailure if writing this file needs a package that is not installed."""
    extra = _EXTRA_BY_SUFFIX.get(path.suffix.lower())
    if extra is not None and missing_packages(extra):
        alternative = "; or use a name ending in .csv" if extra == "io" else ""
        raise EnvironmentFailure(
            f"{option} {path}: this needs {', '.join(missing_packages(extra))}, not installed: "
            f"{install_command(extra)}{alternative}"
        )


def result_ending() -> str:
    """Default ending of a result file: .nc if NetCDF can be written, else .csv."""
    return ".csv" if missing_packages("io") else ".nc"


def title_from_path(path: Path) -> str:
    """Name of the file, or of its folder if the file is named "scene"."""
    return path.absolute().parent.name if path.stem == "scene" else path.stem


def require_python_file(path: str) -> str:
    """Check that a path is an existing Python file; MstmmError for anything else."""
    if not path.endswith(".py"):
        raise MstmmError(f"{quote(path)}: expected a Python file (.py) that defines elements")
    if "\0" in path or not os.path.isfile(path):
        raise MstmmError(f"{quote(path)}: there is no such Python file; check the path")
    return path


#: Options of several commands.
SceneFile = Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")]
EndTime = Annotated[float, option("--t-end", "S", "End time, s.", parse_positive)]
Plot = Annotated[str | None, option("--plot", "FILE", "Plot file: .png, .svg or .pdf.")]
Elements = Annotated[
    list[str] | None,
    option(
        "--hinge", "FILE", "Python file that defines user elements (it is executed); repeatable."
    ),
]
Budget = Annotated[
    float, option("--budget", "SECONDS", "Wall-clock time limit, s.", parse_positive)
]
Rounds = Annotated[int, option("--rounds", "N", "Number of timing repetitions.", integer_parser(0))]
Json = Annotated[bool, flag("--json", "Print JSON instead of text.")]
