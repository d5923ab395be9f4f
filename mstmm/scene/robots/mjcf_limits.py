"""Limits of MJCF elements: tags in lower case, bounded size and number of copies."""

from __future__ import annotations

from math import prod

from ...errors import SceneError
from .xml_reader import Element

#: Most elements of a model, including copies by `replicate` and others.
MAX_ELEMENT_COUNT = 200_000
#: Most numbers that MuJoCo stores for an element: points of a height field, pixels of a texture.
_MAX_STORED_NUMBERS = 2**24
#: Elements that create copies of their content.
_COPYING_TAGS = ("replicate", "composite", "flexcomp")
#: Keys whose product is the size of an element.
_SIZE_KEYS = {"hfield": ("nrow", "ncol"), "texture": ("width", "height")}


def check_element(element: Element) -> None:
    """Reject tags in capitals, some of which MuJoCo misreads, and too large elements.

    Raises SceneError.
    """
    if element.tag != element.tag.lower():
        raise SceneError(
            f"{element.where}: unknown element <{element.tag}>; write <{element.tag.lower()}>"
        )
    size = prod(_whole_numbers(element, key, 1)[0] for key in _SIZE_KEYS.get(element.tag, ()))
    if size > _MAX_STORED_NUMBERS:
        raise SceneError(
            f"{element.where}: <{element.tag}>: expected at most {_MAX_STORED_NUMBERS} numbers, "
            f"found {size}; make it coarser, or leave it out"
        )


def count_copies(element: Element) -> int:
    """Number of copies of the content that an element creates."""
    return prod(_whole_numbers(element, "count", 3)) if element.tag in _COPYING_TAGS else 1


def _whole_numbers(element: Element, key: str, most: int) -> list[int]:
    """Whole numbers of an attribute, at least 1; MuJoCo reports invalid text."""
    values = []
    for number_text in element.attributes.get(key, "").split()[:most]:
        try:
            values.append(max(1, int(float(number_text))))
        except (ValueError, OverflowError):
            values.append(1)
    return values or [1]
