"""Comparison of a hinge's classical transfer matrix with its motion subspace."""

from __future__ import annotations

from collections.abc import Callable

from mstmm.errors import ElementError

from .document import Heading, Item, Paragraph, document
from .formula_width import TextWidth
from .subjects import element_view

#: Hinges that have a classical matrix in acceleration form.
CLASSICAL_COUNTERPARTS = {"hinge_ball": "classical_ball", "hinge_pin": "classical_pin_spatial"}

_EXPLANATION = (
    "Both forms relate accelerations and loads on the two sides of a hinge. The classical matrix "
    "maps the state z_I of the inboard side to the state z_O of the outboard side. The relative "
    "acceleration follows from a block of the outboard body, so the matrix depends on hinge and "
    "body. The motion subspace H depends on the hinge only: the relative acceleration is H udot, "
    "and the load f satisfies H^T f = tau with the effort tau. The sweep then uses f = S a + e of "
    "the outboard body and factors D = H^T S H, which has one row for each free speed."
)


def classical_comparison(name: str) -> tuple[str, Callable[[TextWidth], list[Item]]]:
    """Title and items of a page that compares both forms of a hinge ("hinge_pin").

    Raises ElementError for a hinge without a classical matrix.
    """
    if name not in CLASSICAL_COUNTERPARTS:
        available = ", ".join(
            full_name.removeprefix("hinge_") for full_name in CLASSICAL_COUNTERPARTS
        )
        raise ElementError(f"{name}: no classical matrix exists; expected one of {available}")
    hinge_view = element_view(name)
    title = f"{hinge_view.title}, classical and by motion subspace"

    def items(measure: TextWidth) -> list[Item]:
        page_items: list[Item] = [Heading(title, 1), Paragraph(_EXPLANATION)]
        for heading, counterpart in (
            ("Classical transfer matrix", element_view(CLASSICAL_COUNTERPARTS[hinge_view.name])),
            ("Motion subspace", hinge_view),
        ):
            page_items += [Heading(heading, 2), *document(counterpart, "equations", measure)[1:]]
        return page_items

    return title, items
