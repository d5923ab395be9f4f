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
    "Both say what a hinge does to accelerations and loads. The classical matrix takes the whole "
    "state z_I of the inboard side to the state z_O behind the hinge; the relative acceleration, "
    "which it cannot know, it finds from the block of the body outboard, so that the matrix "
    "belongs to the two together. The motion subspace H says the same of the hinge alone: the "
    "relative acceleration is H udot, and the load f has no share on it but the effort, "
    "H^T f = tau. The sweep then asks the body outboard through f = S a + e, and divides by "
    "D = H^T S H, which has a row for each free speed and no more."
)


def classical_comparison(name: str) -> tuple[str, Callable[[TextWidth], list[Item]]]:
    """Title and items of a hinge ("hinge_pin") in both forms.

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
