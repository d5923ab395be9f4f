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

from mstmm.arguments import path_of, text_of, texts_of
from mstmm.arrays import whole
from mstmm.errors import SceneError
from mstmm.markup import Displayed

from ...host.files import replacing
from .choices import Part, together
from .film import FILMS, STRIPS, film, frames, shots_of, shots_over, strip
from .page import page
from .staging import staged

if TYPE_CHECKING:
    from ..record import Record

#: Endings of the files that a view can be.
ENDINGS = (".html", *STRIPS, *FILMS)
#: Height of a page in a notebook.
_INLINE = "480px"


class View(Displayed):
    """View of a run.  Notebooks display it; `save` writes it.

    Attributes:
        stage: everything that is seen, as triangles and poses over time.
        parts: (name, stage) of what can be chosen, or of the one that there is.
    """

    def __init__(self, title: str, parts: Sequence[Part]) -> None:
        self.parts = tuple(parts)
        self.stage = parts[0][1] if len(parts) == 1 else together(title, parts)

    @cached_property
    def html(self) -> str:
        """One page that needs no network (extra: view)."""
        return page(self.stage)

    def save(self, path: str | Path, moments: int = 6, title: bool = False) -> Path:
        """Write a page (.html, extra: view), a strip of so many `moments` (.png, .svg, .pdf), with
        its title above where that is asked for, a film (.gif, .mp4) or, into a folder, every frame
        (extra: plot); returns the path.

        Where there is something to choose a strip has the first moment of each, and films show one
        after the other.

        A file appears under its name when it is whole.  SceneError for another ending,
        EnvironmentFailure for what is not installed or cannot be written.
        """
        path = path_of("view", path)
        moments = whole("moments", moments, 1, "a whole number, 1 or more")
        ending = path.suffix.lower()
        if not ending:
            frames(shots_over(self.parts, self.stage), path)
            return path
        if ending not in ENDINGS:
            raise SceneError(
                f'view "{path}": expected a name ending in {", ".join(ENDINGS)}, or a folder for '
                "frames, without an ending"
            )
        with replacing(path) as part:
            self._write(part, ending, moments, self.stage.title if title else "")
        return path

    def _write(self, part: Path, ending: str, moments: int, title: str) -> None:
        if ending == ".html":
            part.write_text(self.html, encoding="utf-8")
        elif ending in STRIPS:
            strip(shots_of(self.parts, self.stage, moments), part, ending[1:], title)
        else:  # writers of films go by the ending
            with TemporaryDirectory() as folder:
                made = Path(folder) / f"film{ending}"
                film(shots_over(self.parts, self.stage), made)
                shutil.copyfile(made, part)

    def picture(self, moments: int = 6) -> bytes:
        """The same strip as a PNG in memory, which stays small where there is much to draw."""
        drawn = BytesIO()
        strip(shots_of(self.parts, self.stage, moments), drawn, "png")
        return drawn.getvalue()

    def __repr__(self) -> str:
        return f"<View: {self.stage.title}>"

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(self.html)}" style="width:100%;height:{_INLINE};border:0">'
            "</iframe>"
        )


def view(
    run: Record,
    title: str,
    trails: Sequence[str],
    speed: float | None,
) -> View:
    """See `Result.view`."""
    trails = texts_of("trails", trails, "rod2.tip")
    title = text_of("title", title) or ""
    return View(title, [(title, staged(run, title, trails, speed))])
