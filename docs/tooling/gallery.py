"""Mechanisms that move: a block `{moving} EXAMPLE` becomes a page of its own.

python docs/tooling/gallery.py makes the pictures of the gallery anew.
"""

from __future__ import annotations

import logging
import re
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive, directives

import mstmm

ROOT = Path(__file__).parents[2]
_PAGE = ROOT / "docs" / "gallery.md"
_BLOCK = re.compile(r"^```\{moving\} (\w+)\n((?::.*\n)*)```$", re.M)
_OPTION = re.compile(r"^:(\w+): (.+)$", re.M)


def view_of(example: str, until: str, trail: str = "") -> Any:
    """The view of an example run for `until` seconds; the way of the end `trail` is drawn."""
    model = mstmm.compile(mstmm.load_scene(ROOT / "examples" / example / "scene.toml"))
    title = example.replace("_", " ")
    return model.simulate(t_end=float(until)).view(trails=trail.split(), title=title)


class Moving(Directive):
    """`{moving} EXAMPLE` with `:until: SECONDS` and, where wanted, `:trail: END`."""

    required_arguments = 1
    option_spec = {"until": directives.unchanged_required, "trail": directives.unchanged}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        """The page is written beside the pages; it is fetched when the reader opens it."""
        example = self.arguments[0]
        app = self.state.document.settings.env.app
        page = Path(app.outdir, "moving", f"{example}.html")
        page.parent.mkdir(parents=True, exist_ok=True)
        view_of(example, **self.options).save(page)
        frame = (
            f'<details class="moving"><summary>Show the animation</summary>'
            f'<iframe src="moving/{example}.html" title="{example} in motion" loading="lazy">'
            f'</iframe></details><p class="moving"><a href="moving/{example}.html" target="_blank">'
            "Open in a new tab</a></p>"
        )
        return [nodes.raw("", frame, format="html")]


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.add_directive("moving", Moving)
    # A page is written through viser's server, which tells the log when it begins and ends.
    logging.getLogger("websockets").setLevel(logging.WARNING)


if __name__ == "__main__":
    from PIL import Image

    for example, options in _BLOCK.findall(_PAGE.read_text("utf-8")):
        picture = ROOT / "docs" / "images" / "gallery" / f"{example}.png"
        view_of(example, **dict(_OPTION.findall(options))).save(picture, moments=3)
        strip = Image.open(picture)
        white = Image.new("RGB", strip.size, "white")
        white.paste(strip, mask=strip.getchannel("A"))
        small = white.resize((1080, strip.height * 1080 // strip.width)).quantize(64)
        small.save(picture, optimize=True)
