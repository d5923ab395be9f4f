"""Views of a run: page, strip, film or frames, chosen by the file ending."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from functools import cached_property
from html import escape
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from mstmm.argument_validation import optional_text, require_path, require_texts
from mstmm.array_validation import integer
from mstmm.display import NotebookDisplay
from mstmm.errors import SceneError

from ...platform_support.safe_files import replace_atomically
from .html_page import render_page
from .image_export import (
    FILM_SUFFIXES,
    STRIP_SUFFIXES,
    film_frames,
    strip_frames,
    write_film,
    write_frames,
    write_strip,
)
from .page_selector import Part, combine_stages
from .scene_builder import build_scene_graph

if TYPE_CHECKING:
    from ..result_record import Record

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
