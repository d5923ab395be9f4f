"""A stage as pictures: a strip of moments, numbered frames, GIF and MP4 (extra: plot)."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import IO, Any

import numpy as np

from mstmm.errors import EnvironmentFailure, MstmmError
from mstmm.extras import missing

from .drawn import Flat
from .stage import Stage

#: Endings of strips and of films.
STRIPS, FILMS = (".png", ".svg", ".pdf"), (".gif", ".mp4")

#: Inches: width of a strip and of a frame, room for a line of text; dots per inch of frames.
_STRIP, _FRAME, _LINE, _DOTS = 7.2, 6.4, 0.28, 100
#: Most pictures a second of a GIF, which is large; moments in one row of a strip.
_GIF_RATE, _ROW = 15.0, 6


def strip(stage: Stage, file: Path | IO[str], kind: str, count: int = 6) -> None:
    """A picture of `count` moments side by side, for papers; `kind` is png, svg or pdf."""
    flat = Flat(stage)
    some = np.unique(np.linspace(0, len(stage.times) - 1, max(1, count)).round().astype(int))
    columns = _columns(len(some), flat.shape)
    rows = -(-len(some) // columns)
    wide = _STRIP / columns
    figure = _figure(_STRIP, rows * (wide * flat.shape + _LINE))
    for place, k in enumerate(some):
        axis = figure.add_subplot(rows, columns, place + 1)
        flat.draw(axis, int(k))
        axis.set_title(f"t = {stage.times[k]:.3g} s", fontsize=8.5, pad=2)
    figure.subplots_adjust(0.01, 0.01, 0.99, 1 - 0.8 * _LINE / figure.get_figheight(), 0.04, 0.14)
    figure.savefig(file, dpi=200, format=kind)


def _columns(count: int, shape: float) -> int:
    """Moments in a row: about as many as make the strip wider than it is tall."""
    if shape > 0.8:
        return min(count, _ROW)
    return min(count, max(1, int(np.ceil(np.sqrt(count * shape * 2.2)))))


def film(stage: Stage, path: Path) -> None:
    """A GIF or an MP4, by the ending.  EnvironmentFailure where an MP4 lacks ffmpeg."""
    figure, axis, flat = _frame(stage)
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
            for k in range(0, len(stage.times), every):
                _show(axis, flat, k)
                writer.grab_frame(facecolor="white")


#: Every player takes this kind of colours; sizes must be even.
_PLAYABLE = ["-pix_fmt", "yuv420p", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"]


def frames(stage: Stage, folder: Path) -> Sequence[Path]:
    """Every moment as frame_0001.png and so on; MstmmError where the folder cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MstmmError(f'frames: "{folder}" cannot be made ({error.strerror})') from None
    figure, axis, flat = _frame(stage)
    made = []
    for k in range(len(stage.times)):
        _show(axis, flat, k)
        made.append(folder / f"frame_{k + 1:04d}.png")
        figure.savefig(made[-1], dpi=_DOTS)
    return made


def _frame(stage: Stage) -> tuple[Any, Any, Flat]:
    flat = Flat(stage)
    figure = _figure(_FRAME, min(_FRAME * flat.shape, 1.4 * _FRAME) + _LINE)
    tall = 1 - _LINE / figure.get_figheight()
    return figure, figure.add_axes((0.0, 0.0, 1.0, tall)), flat


def _show(axis: Any, flat: Flat, k: int) -> None:
    axis.clear()
    flat.draw(axis, k)
    stage = flat.stage
    rate = "" if stage.speed == 1 else f"   ({stage.speed:g} s in a second)"
    axis.set_title(
        f"{stage.title}   t = {stage.times[k]:.{stage.digits}f} s{rate}", fontsize=9, pad=4
    )


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
