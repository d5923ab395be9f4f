"""Views of a run: page, strip, numbered frames, GIF and MP4, chosen by the file ending."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from importlib import import_module
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from mstmm.argument_validation import optional_text, require_path, require_texts
from mstmm.array_validation import integer
from mstmm.display import NotebookDisplay, escape_control_characters
from mstmm.errors import EnvironmentFailure, MstmmError, SceneError

from ...figures import figure_class
from ...platform_support.safe_files import replace_atomically
from .html_page import render_page
from .projection import ProjectedFrame
from .scene_builder import build_scene_graph
from .scene_graph import Part, SceneGraph, combine_stages

if TYPE_CHECKING:
    from ..result_record import Record

# --- images (extra: plot) -------------------------------------------------------------------------

#: Suffixes of strips and of films.
STRIP_SUFFIXES, FILM_SUFFIXES = (".png", ".svg", ".pdf"), (".gif", ".mp4")

#: Inches: width of a strip and of a frame, height of a line of text; dots per inch of frames.
_STRIP_WIDTH, _FRAME_WIDTH, _LINE_HEIGHT, _FRAME_DPI = 7.2, 6.4, 0.28, 100
#: Largest frame rate of a GIF, because GIF files are large; frames in one row of a strip.
_MAX_GIF_RATE, _MAX_STRIP_COLUMNS = 15.0, 6


@dataclass(frozen=True)
class Frame:
    """Single image: a scene at a frame time, and its title."""

    flat: ProjectedFrame
    moment: int
    title: str


def film_frames(parts: Sequence[Part], whole: SceneGraph) -> list[Frame]:
    """All frames of all parts, one part after the other, in their common window."""
    flats = [ProjectedFrame(part, whole) for _, part in parts]
    several = len(parts) > 1
    return [
        Frame(
            flat,
            k,
            _frame_title(f"{whole.title}   {name}" if several else whole.title, flat.stage, k),
        )
        for flat, (name, _) in zip(flats, parts, strict=True)
        for k in range(len(whole.times))
    ]


def strip_frames(parts: Sequence[Part], whole: SceneGraph, count: int) -> list[Frame]:
    """Frames of a strip: `count` of one part; of several parts, the first of each."""
    if len(parts) > 1:
        return [Frame(ProjectedFrame(part, whole), 0, name) for name, part in parts]
    indices = np.unique(np.linspace(0, len(whole.times) - 1, max(1, count)).round().astype(int))
    quantity, unit = whole.clock
    flat = ProjectedFrame(whole)
    return [Frame(flat, int(k), f"{quantity} = {whole.times[k]:.3g} {unit}") for k in indices]


def write_strip(shots: Sequence[Frame], file: Path | IO[bytes], kind: str, title: str = "") -> None:
    """Write images in a row for publications; `kind` is png, svg or pdf."""
    shape = shots[0].flat.shape
    columns = _column_count(len(shots), shape)
    rows = -(-len(shots) // columns)
    cell_width, title_height = _STRIP_WIDTH / columns, _LINE_HEIGHT if title else 0.0
    figure = _new_figure(_STRIP_WIDTH, rows * (cell_width * shape + _LINE_HEIGHT) + title_height)
    for cell_index, shot in enumerate(shots):
        axis = figure.add_subplot(rows, columns, cell_index + 1)
        shot.flat.draw(axis, shot.moment)
        axis.set_title(escape_control_characters(shot.title), fontsize=8.5, pad=2, parse_math=False)
    top = 1 - (0.8 * _LINE_HEIGHT + title_height) / figure.get_figheight()
    if title:
        figure.suptitle(
            escape_control_characters(title),
            fontsize=10.5,
            y=1 - 0.2 * title_height / figure.get_figheight(),
            va="top",
            parse_math=False,
        )
    figure.subplots_adjust(0.01, 0.01, 0.99, top, 0.04, 0.14)
    figure.savefig(file, dpi=200, format=kind)


def _column_count(count: int, shape: float) -> int:
    """Frames in a row, about as many as make the strip wider than tall."""
    max_columns = (
        _MAX_STRIP_COLUMNS if shape > 0.8 else max(1, int(np.ceil(np.sqrt(count * shape * 2.2))))
    )
    rows = -(-count // min(count, max_columns))
    return -(-count // rows)  # rows of equal length, so that the last one has no gap


def write_film(shots: Sequence[Frame], path: Path) -> None:
    """Write a GIF or an MP4 by suffix. EnvironmentFailure if an MP4 lacks ffmpeg."""
    stage = shots[0].flat.stage
    figure, axis = _frame_figure(shots[0].flat)
    from matplotlib import animation, rc_context

    duration = float(stage.times[-1] - stage.times[0]) / stage.speed
    rate = max(1, round((len(stage.times) - 1) / duration)) if duration else 1
    gif = path.suffix.lower() == ".gif"
    frame_step = max(1, round(rate / _MAX_GIF_RATE)) if gif else 1
    with rc_context({} if gif else {"animation.ffmpeg_path": _ffmpeg_path()}):
        writer: Any = (
            animation.PillowWriter(fps=max(1, round(rate / frame_step)))
            if gif
            else animation.FFMpegWriter(fps=rate, codec="h264", extra_args=_FFMPEG_ARGUMENTS)
        )
        with writer.saving(figure, str(path), dpi=_FRAME_DPI):
            for shot in shots[::frame_step]:
                _show_frame(axis, shot)
                writer.grab_frame(facecolor="white")


#: Pixel format that every player supports; sizes must be even.
_FFMPEG_ARGUMENTS = ["-pix_fmt", "yuv420p", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"]


def write_frames(shots: Sequence[Frame], folder: Path) -> Sequence[Path]:
    """Write all frames as frame_0001.png etc.; MstmmError if the folder cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MstmmError(f'frames: "{folder}" cannot be created ({error.strerror})') from None
    figure, axis = _frame_figure(shots[0].flat)
    paths = []
    for k, shot in enumerate(shots, 1):
        _show_frame(axis, shot)
        paths.append(folder / f"frame_{k:04d}.png")
        figure.savefig(paths[-1], dpi=_FRAME_DPI)
    return paths


def _frame_figure(flat: ProjectedFrame) -> tuple[Any, Any]:
    figure = _new_figure(
        _FRAME_WIDTH, min(_FRAME_WIDTH * flat.shape, 1.4 * _FRAME_WIDTH) + _LINE_HEIGHT
    )
    axes_height = 1 - _LINE_HEIGHT / figure.get_figheight()
    return figure, figure.add_axes((0.0, 0.0, 1.0, axes_height))


def _show_frame(axis: Any, shot: Frame) -> None:
    axis.clear()
    shot.flat.draw(axis, shot.moment)
    axis.set_title(escape_control_characters(shot.title), fontsize=9, pad=4, parse_math=False)


def _frame_title(title: str, stage: SceneGraph, k: int) -> str:
    quantity, unit = stage.clock
    rate = "" if stage.speed == 1 or unit != "s" else f"   (speed {stage.speed:g})"
    digits = stage.digits if unit == "s" else 0
    return f"{title}   {quantity} = {stage.times[k]:.{digits}f} {unit}{rate}"


def _new_figure(wide: float, tall: float) -> Any:
    return figure_class("a film or a strip")(figsize=(wide, tall), facecolor="white")


def _ffmpeg_path() -> str:
    """Path of the program that writes MP4: ffmpeg, or that of imageio-ffmpeg."""
    executable = shutil.which("ffmpeg")
    if executable is None:
        try:
            executable = import_module("imageio_ffmpeg").get_ffmpeg_exe()
        except ImportError:
            raise EnvironmentFailure(
                "MP4 requires the program ffmpeg, which is not installed; install it, or pip "
                "install imageio-ffmpeg, or use a name ending in .gif"
            ) from None
    return str(executable)


# --- views ----------------------------------------------------------------------------------------

#: File suffixes of views.
VIEW_SUFFIXES = (".html", *STRIP_SUFFIXES, *FILM_SUFFIXES)
#: Height of a page in a notebook.
_NOTEBOOK_HEIGHT = "480px"


class SceneView(NotebookDisplay):
    """View of a run. Notebooks display it; `save` writes it.

    Attributes:
        stage: the scene graph as triangles and poses over time.
        parts: (name, stage) of the selectable parts, or of the only one.
    """

    def __init__(self, title: str, parts: Sequence[Part]) -> None:
        self.parts = tuple(parts)
        self.stage = parts[0][1] if len(parts) == 1 else combine_stages(title, parts)

    @cached_property
    def html(self) -> str:
        """Self-contained page that needs no network (extra: view)."""
        return render_page(self.stage)

    def save(self, path: str | Path, moments: int = 6, title: bool = False) -> Path:
        """Write a view in the format given by the suffix; returns the path.

        A page (.html, extra: view), a strip of `moments` frames (.png, .svg, .pdf), with its title
        above if `title` is true, a film (.gif, .mp4) or, into a folder, every frame (extra: plot).

        With several parts, a strip has the first frame of each, and films show one after the other.

        A file appears under its name when it is complete. SceneError for another suffix,
        EnvironmentFailure for missing extras and files that cannot be written.
        """
        path = require_path("view", path)
        moments = integer("moments", moments, 1, "a whole number, 1 or more")
        ending = path.suffix.lower()
        if not ending:
            write_frames(film_frames(self.parts, self.stage), path)
            return path
        if ending not in VIEW_SUFFIXES:
            raise SceneError(
                f'view "{path}": expected a name ending in {", ".join(VIEW_SUFFIXES)}, or a '
                "folder for frames, without an ending"
            )
        with replace_atomically(path) as temporary_path:
            self._write(temporary_path, ending, moments, self.stage.title if title else "")
        return path

    def _write(self, part: Path, ending: str, moments: int, title: str) -> None:
        if ending == ".html":
            part.write_text(self.html, encoding="utf-8")
        elif ending in STRIP_SUFFIXES:
            write_strip(strip_frames(self.parts, self.stage, moments), part, ending[1:], title)
        else:  # writers of films depend on the suffix
            with TemporaryDirectory() as folder:
                film_path = Path(folder) / f"film{ending}"
                write_film(film_frames(self.parts, self.stage), film_path)
                shutil.copyfile(film_path, part)

    def strip_png(self, moments: int = 6) -> bytes:
        """Strip as a PNG in memory, which stays small for complex scenes."""
        buffer = BytesIO()
        write_strip(strip_frames(self.parts, self.stage, moments), buffer, "png")
        return buffer.getvalue()

    def __repr__(self) -> str:
        return f"<View: {self.stage.title}>"

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(self.html)}" '
            f'style="width:100%;height:{_NOTEBOOK_HEIGHT};border:0">'
            "</iframe>"
        )


def make_view(run: Record, title: str, trails: Sequence[str], speed: float | None) -> SceneView:
    """Create the view of a run; see `Result.view`."""
    trails = require_texts("trails", trails, "rod2.tip")
    title = optional_text("title", title) or ""
    return SceneView(title, [(title, build_scene_graph(run, title, trails, speed))])
