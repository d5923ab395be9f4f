"""Titles of panels: noun, owner and unit."""

from __future__ import annotations

from collections.abc import Sequence

from ..quantity_names import Quantity

#: Nouns of quantities that share only a unit.
_NOUN_BY_UNIT = {
    "rad": "angles", "m": "lengths", "rad/s": "angular velocities", "m/s": "velocities",
    "rad/s2": "angular accelerations", "m/s2": "accelerations", "N": "forces", "N*m": "moments",
    "J": "energies", "W": "powers", "kg*m/s": "momenta", "kg*m2/s": "angular momenta",
    "": "numbers",
}  # fmt: skip

_UNIT_TEXT = {
    "N*m": "N m",
    "m/s2": "m/s²",
    "rad/s2": "rad/s²",
    "kg*m/s": "kg m/s",
    "kg*m2/s": "kg m²/s",
}

#: Largest number of owners that are named individually.
_MAX_NAMED_OWNERS = 3


def with_unit(text: str, unit: str) -> str:
    """Text with its unit: angle of hinge elbow (rad)."""
    unit_text = _UNIT_TEXT.get(unit, unit)
    return f"{text} ({unit_text})" if unit_text else text


def common_noun(quantities: Sequence[Quantity]) -> str:
    """Common noun of quantities of one unit.

    "angle of hinge elbow", "angle of hinges a, b", "lengths".
    """
    first = quantities[0]
    if len(quantities) == 1:
        return first.long_name if first.owner or not first.description else first.description
    owners = list(dict.fromkeys(quantity.owner for quantity in quantities))
    if (
        len({quantity.description or quantity.long_name for quantity in quantities}) == 1
        and first.description
    ):
        return (
            f"{first.description} of {_join_owners(owners)}" if first.owner else first.description
        )
    descriptions = list(
        dict.fromkeys(quantity.description or quantity.name for quantity in quantities)
    )
    if not any(owners) and len(descriptions) <= _MAX_NAMED_OWNERS:
        return ", ".join(descriptions)
    text = _NOUN_BY_UNIT.get(first.unit, "quantities")
    return f"{text} of {owners[0]}" if len(owners) == 1 and owners[0] else text


def _join_owners(owners: list[str]) -> str:
    """Joined owners: hinges elbow, wrist; rod1, rod2; 7 hinges."""
    words = {owner.partition(" ")[0] if " " in owner else "" for owner in owners}
    word = words.pop() if len(words) == 1 else ""
    if len(owners) == 1:
        return owners[0]
    if len(owners) > _MAX_NAMED_OWNERS:
        return f"{len(owners)} {word}s" if word else f"{len(owners)} bodies and ends"
    names = [owner.removeprefix(f"{word} ") if word else owner for owner in owners]
    return f"{word}s {', '.join(names)}" if word else ", ".join(names)
