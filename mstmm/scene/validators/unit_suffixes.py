"""Numbers with unit suffixes, such as "30 deg", which scenes do not accept: the remedy."""

from __future__ import annotations

import math
import re

#: Unit suffix -> its factor to SI units and rad.
_UNIT_FACTORS = {
    "deg": math.pi / 180, "degree": math.pi / 180, "degrees": math.pi / 180, "°": math.pi / 180,
    "deg/s": math.pi / 180, "°/s": math.pi / 180, "rad": 1.0, "rad/s": 1.0,
    "rev": 2 * math.pi, "turn": 2 * math.pi, "turns": 2 * math.pi, "rpm": math.pi / 30,
    "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "km": 1e3, "in": 0.0254, "ft": 0.3048,
    "m/s": 1.0, "mm/s": 1e-3, "km/h": 1 / 3.6, "ms": 1e-3, "s": 1.0, "min": 60.0,
    "g": 1e-3, "kg": 1.0, "t": 1e3, "N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "Nm": 1.0,
    "N*m": 1.0, "Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "kg*m2": 1.0, "kg*m^2": 1.0,
    "N/m": 1.0, "N/mm": 1e3, "kN/m": 1e3, "%": 0.01,
}  # fmt: skip
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\D.*?)?\s*")


def unit_hint(text: str) -> str:
    """Remedy '; write ...' for text given in place of a number, or ""."""
    match = _QUANTITY.fullmatch(text)
    if match is None:
        return ""
    if not match[2]:
        return "; write the number without quotes"
    return unit_remedy(text) or "; write only the number, without quotes, in SI units and rad"


def unit_remedy(text: str) -> str:
    """Remedy for a number with a known unit suffix, or ""."""
    match = _QUANTITY.fullmatch(text)
    if match is None or match[2] not in _UNIT_FACTORS:
        return ""
    value = float(match[1]) * _UNIT_FACTORS[match[2]]
    return f"; leave out the unit, all numbers are in SI units and rad: write {value:.12g}"


def is_number(text: str) -> bool:
    """Whether the text is a plain number, which needs no quotes."""
    match = _QUANTITY.fullmatch(text)
    return match is not None and not match[2]
