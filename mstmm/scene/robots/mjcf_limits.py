"""Limits of MJCF elements: tags in lower case, bounded size and number of copies."""

from __future__ import annotations

from math import prod

from ...errors import SceneError
from .markup import Element

#: Most elements of a model, including copies by `replicate` and others.
MOST_ELEMENTS = 200_000
#: Most numbers that MuJoCo stores for an element: points of a height field, pixels of a texture.
_MOST_NUMBERS = 2**24
#: Elements that create copies of their content.
_COPYING = ("replicate", "composite", "flexcomp")
#: Keys whose product is the size of an element.
_SIZES = {"hfield": ("nrow", "ncol"), "texture": ("width", "height")}


def check_element(element: Element) -> None:
    """Reject tags in capitals, some of which MuJoCo misreads, and too large elements.

    Raises SceneError.
    """
    if element.tag != element.tag.lower():
        raise SceneError(
            f"{element.where}: unknown element <{element.tag}>; write <{element.tag.lower()}>"
        )
    size = prod(_numbers(element, key, 1)[0] for key in _SIZES.get(element.tag, ()))
    if size > _MOST_NUMBERS:
        raise SceneError(
            f"{element.where}: <{element.tag}>: expected at most {_MOST_NUMBERS} numbers, found "
            f"{size}; make it coarser, or leave it out"
        )


def count_copies(element: Element) -> int:
    """Number of copies of the content that an element creates."""
    return prod(_numbers(element, "count", 3)) if element.tag in _COPYING else 1


def _numbers(element: Element, key: str, most: int) -> list[int]:
    """Whole numbers of an attribute, at least 1; MuJoCo reports invalid text."""
    found = []
    for word in element.attributes.get(key, "").split()[:most]:
        try:
            found.append(max(1, int(float(word))))
        except (ValueError, OverflowError):
            found.append(1)
    return found or [1]
