"""A stage as pictures: a strip of moments, numbered frames, GIF and MP4 (extra: plot)."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import IO, Any

import numpy as np

from mstmm.errors import EnvironmentFailure, MstmmError
from mstmm.extras import missing
from mstmm.printable import printable

from .choices import Part
from .drawn import Flat
from .stage import Stage

#: Endings of strips and of films.
STRIPS, FILMS = (".png", ".svg", ".pdf"), (".gif", ".mp4")

#: Inches: width of a strip and of a frame, room for a line of text; dots per inch of frames.
_STRIP, _FRAME, _LINE, _DOTS = 7.2, 6.4, 0.28, 100
#: Most pictures a second of a GIF, which is large; moments in one row of a strip.
_GIF_RATE, _ROW = 15.0, 6


@dataclass(frozen=True)
class Shot:
    """One picture: a stage at a moment, and what stands above it."""

    flat: Flat
    moment: int
    title: str


def shots_over(parts: Sequence[Part], whole: Stage) -> list[Shot]:
    """Every moment of every part, one part after the other, in the window of them all."""
    flats = [Flat(part, whole) for _, part in parts]
    several = len(parts) > 1
    return [
        Shot(flat, k, _above(f"{whole.title}   {name}" if several else whole.title, flat.stage, k))
        for flat, (name, _) in zip(flats, parts, strict=True) for k in range(len(whole.times))
    ]  # fmt: skip


def shots_of(parts: Sequence[Part], whole: Stage, count: int) -> list[Shot]:
    """So many moments; of several parts the first moment of each."""
    if len(parts) > 1:
        return [Shot(Flat(part, whole), 0, name) for name, part in parts]
    some = np.unique(np.linspace(0, len(whole.times) - 1, max(1, count)).round().astype(int))
    what, unit = whole.clock
    flat = Flat(whole)
    return [Shot(flat, int(k), f"{what} = {whole.times[k]:.3g} {unit}") for k in some]


def strip(shots: Sequence[Shot], file: Path | IO[bytes], kind: str, title: str = "") -> None:
    """Pictures side by side, for papers; `kind` is png, svg or pdf."""
    shape = shots[0].flat.shape
    columns = _columns(len(shots), shape)
    rows = -(-len(shots) // columns)
    wide, above = _STRIP / columns, _LINE if title else 0.0
    figure = _figure(_STRIP, rows * (wide * shape + _LINE) + above)
    for place, shot in enumerate(shots):
        axis = figure.add_subplot(rows, columns, place + 1)
        shot.flat.draw(axis, shot.moment)
        axis.set_title(printable(shot.title), fontsize=8.5, pad=2, parse_math=False)
    top = 1 - (0.8 * _LINE + above) / figure.get_figheight()
    if title:
        figure.suptitle(printable(title), fontsize=10.5, y=1 - 0.2 * above / figure.get_figheight(),
                        va="top", parse_math=False)  # fmt: skip
    figure.subplots_adjust(0.01, 0.01, 0.99, top, 0.04, 0.14)
    figure.savefig(file, dpi=200, format=kind)


def _columns(count: int, shape: float) -> int:
    """Moments in a row: about as many as make the strip wider than it is tall."""
    most = _ROW if shape > 0.8 else max(1, int(np.ceil(np.sqrt(count * shape * 2.2))))
    rows = -(-count // min(count, most))
    return -(-count // rows)  # rows alike, so that the last one has no hole


def film(shots: Sequence[Shot], path: Path) -> None:
    """A GIF or an MP4, by the ending.  EnvironmentFailure where an MP4 lacks ffmpeg."""
    stage = shots[0].flat.stage
    figure, axis = _frame(shots[0].flat)
    from matplotlib import animation, rc_context

    lasts = _seconds(stage)
    rate = max(1, round((len(stage.times) - 1) / lasts)) if lasts else 1
    gif = path.suffix.lower() == ".gif"
    every = max(1, round(rate / _GIF_RATE)) if gif else 1
    with rc_context({} if gif else {"animation.ffmpeg_path": _ffmpeg()}):
        writer: Any = (
            animation.PillowWriter(fps=max(1, round(rate / every)))
            if gif
            else animation.FFMpegWriter(fps=rate, codec="h264", extra_args=_PLAYABLE)
        )
        with writer.saving(figure, str(path), dpi=_DOTS):
            for shot in shots[::every]:
                _show(axis, shot)
                writer.grab_frame(facecolor="white")


#: Every player takes this kind of colours; sizes must be even.
_PLAYABLE = ["-pix_fmt", "yuv420p", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"]


def frames(shots: Sequence[Shot], folder: Path) -> Sequence[Path]:
    """Every picture as frame_0001.png and so on; MstmmError where the folder cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MstmmError(f'frames: "{folder}" cannot be made ({error.strerror})') from None
    figure, axis = _frame(shots[0].flat)
    made = []
    for k, shot in enumerate(shots, 1):
        _show(axis, shot)
        made.append(folder / f"frame_{k:04d}.png")
        figure.savefig(made[-1], dpi=_DOTS)
    return made


def _frame(flat: Flat) -> tuple[Any, Any]:
    figure = _figure(_FRAME, min(_FRAME * flat.shape, 1.4 * _FRAME) + _LINE)
    tall = 1 - _LINE / figure.get_figheight()
    return figure, figure.add_axes((0.0, 0.0, 1.0, tall))


def _show(axis: Any, shot: Shot) -> None:
    axis.clear()
    shot.flat.draw(axis, shot.moment)
    axis.set_title(printable(shot.title), fontsize=9, pad=4, parse_math=False)


def _above(title: str, stage: Stage, k: int) -> str:
    what, unit = stage.clock
    rate = "" if stage.speed == 1 or unit != "s" else f"   ({stage.speed:g} s in a second)"
    digits = stage.digits if unit == "s" else 0
    return f"{title}   {what} = {stage.times[k]:.{digits}f} {unit}{rate}"


def _seconds(stage: Stage) -> float:
    return float(stage.times[-1] - stage.times[0]) / stage.speed


def _figure(wide: float, tall: float) -> Any:
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise missing("plot", "a film or a strip", error) from None
    made = Figure(figsize=(wide, tall), facecolor="white")
    FigureCanvasAgg(made)
    return made


def _ffmpeg() -> str:
    """The program that writes an MP4: ffmpeg, or the one that imageio-ffmpeg brings."""
    found = shutil.which("ffmpeg")
    if found is None:
        try:
            found = import_module("imageio_ffmpeg").get_ffmpeg_exe()
        except ImportError:
            raise EnvironmentFailure(
                "an MP4 needs the program ffmpeg, which is not on this machine; install it, or "
                "pip install imageio-ffmpeg, or take a name ending in .gif"
            ) from None
    return str(found)
