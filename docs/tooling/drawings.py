"""Drawings stand in the page itself, so that they take its colours, light or dark."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.transforms.post_transforms import SphinxPostTransform


class Drawn(SphinxPostTransform):
    """Replaces each image of the folder of drawings by what its file says."""

    default_priority = 5  # before Sphinx gathers the files of images
    formats = ("html",)

    def run(self, **kwargs: Any) -> None:
        """Called for each page."""
        for image in list(self.document.findall(nodes.image)):
            path = Path(self.app.srcdir, image["uri"])
            if path.parent.name == "drawings":
                drawing = f'<figure class="drawn">{path.read_text("utf-8")}</figure>'
                image.parent.replace(image, nodes.raw("", drawing, format="html"))


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_post_transform(Drawn)
    return {"parallel_read_safe": True}
