"""Comparison of a hinge's classical transfer matrix with its motion subspace."""

from __future__ import annotations

from collections.abc import Callable

from mstmm.errors import ElementError

from .document import Heading, Item, Paragraph, document
from .measure import Columns
from .subjects import view

#: Hinges that have a classical matrix in acceleration form.
CLASSICAL = {"hinge_ball": "classical_ball", "hinge_pin": "classical_pin_spatial"}

_SAID = (
    "Both say what a hinge does to accelerations and loads. The classical matrix takes the whole "
    "state z_I of the inboard side to the state z_O behind the hinge; the relative acceleration, "
    "which it cannot know, it finds from the block of the body outboard, so that the matrix "
    "belongs to the two together. The motion subspace H says the same of the hinge alone: the "
    "relative acceleration is H udot, and the load f has no share on it but the effort, "
    "H^T f = tau. The sweep then asks the body outboard through f = S a + e, and divides by "
    "D = H^T S H, which has a row for each free speed and no more."
)


def beside(name: str) -> tuple[str, Callable[[Columns], list[Item]]]:
    """Title and items of a hinge ("hinge_pin") in both forms.

    Raises ElementError for a hinge without a classical matrix.
    """
    if name not in CLASSICAL:
        both = ", ".join(each.removeprefix("hinge_") for each in CLASSICAL)
        raise ElementError(f"{name}: no classical matrix exists; expected one of {both}")
    shown = view(name)
    title = f"{shown.title}, classical and by motion subspace"

    def items(measure: Columns) -> list[Item]:
        found: list[Item] = [Heading(title, 1), Paragraph(_SAID)]
        for heading, other in (
            ("Classical transfer matrix", view(CLASSICAL[shown.name])),
            ("Motion subspace", shown),
        ):
            found += [Heading(heading, 2), *document(other, "equations", measure)[1:]]
        return found

    return title, items
