"""Tables of sentences: on a narrow screen each row becomes a block, each cell under its heading."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from sphinx.transforms.post_transforms import SphinxPostTransform

#: Characters of the longest cell and of a row from which on the columns of a narrow screen are too
#: narrow for them; of a cell that is not broken, such as 2e-15.
_MAX_CELL, _MAX_ROW, _MAX_UNBROKEN = 40, 70, 12


class StackedTables(SphinxPostTransform):
    """Marks tables of sentences and short cells; repeats the headings in tables of sentences.

    The style shows the repeated headings on narrow screens only.
    """

    default_priority = 5
    formats = ("html",)

    def run(self, **kwargs: Any) -> None:
        """Called for each page."""
        for table in list(self.document.findall(nodes.table)):
            head, body = next(table.findall(nodes.thead), None), next(table.findall(nodes.tbody))
            is_stacked = head is not None and _has_sentences(body)
            for entry in body.findall(nodes.entry):
                text = entry.astext()
                if len(text) <= _MAX_UNBROKEN and not (is_stacked and " " in text):
                    entry["classes"].append("unbroken")
            if head is None or not is_stacked:
                continue
            table["classes"].append("stacked")
            headings = list(head.findall(nodes.entry))
            if len(headings) == 2:  # a name and its description
                continue
            for row in body.findall(nodes.row):
                cells = zip(headings, row.findall(nodes.entry), strict=True)
                for heading, cell in list(cells)[1:]:
                    if heading.astext() and cell.astext():
                        parts = [part.deepcopy() for part in heading[0].children]
                        cell.insert(0, nodes.paragraph("", "", *parts, classes=["column"]))


def _has_sentences(body: nodes.tbody) -> bool:
    """Whether a row is long and has a long cell besides its name."""
    return any(
        len(row.astext()) > _MAX_ROW
        and max(len(cell.astext()) for cell in list(row.findall(nodes.entry))[1:]) > _MAX_CELL
        for row in body.findall(nodes.row)
    )


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_post_transform(StackedTables)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
