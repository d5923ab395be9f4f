"""What an element of MJCF may ask of MuJoCo: a known tag, a bounded size and number of copies."""

from __future__ import annotations

from math import prod

from ...errors import SceneError
from .markup import Element

#: Elements of a model, copies that `replicate` and others make counted each time.
MOST_ELEMENTS = 200_000
#: Numbers that an element makes MuJoCo store: points of a height field, pixels of a texture.
_MOST_NUMBERS = 2**24
#: Elements that multiply what is inside or what they stand for.
_COPYING = ("replicate", "composite", "flexcomp")
#: Keys whose product is the size of an element.
_SIZES = {"hfield": ("nrow", "ncol"), "texture": ("width", "height")}


def check_element(element: Element) -> None:
    """SceneError for a tag in capitals, which MuJoCo takes for another one here and there, and for
    more numbers than a robot needs."""
    if element.tag != element.tag.lower():
        raise SceneError(
            f"{element.where}: unknown element <{element.tag}>; write <{element.tag.lower()}>"
        )
    size = prod(_numbers(element, key, 1)[0] for key in _SIZES.get(element.tag, ()))
    if size > _MOST_NUMBERS:
        raise SceneError(
            f"{element.where}: <{element.tag}> holds {size} numbers; expected at most "
            f"{_MOST_NUMBERS}; make it coarser, or leave it out"
        )


def count_copies(element: Element) -> int:
    """How often what is inside an element is there in the end."""
    return prod(_numbers(element, "count", 3)) if element.tag in _COPYING else 1


def _numbers(element: Element, key: str, most: int) -> list[int]:
    """Whole numbers of an attribute, 1 and more; what is none is left to MuJoCo."""
    found = []
    for word in element.attributes.get(key, "").split()[:most]:
        try:
            found.append(max(1, int(float(word))))
        except (ValueError, OverflowError):
            found.append(1)
    return found or [1]
