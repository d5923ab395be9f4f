"""Solid elements of degree 1 in more and more slender bars."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import bending_error
from ...parameter_scale import LOG_SCALE

DIVISIONS = (20, 1, 1)


def _error(slenderness: float, order: int) -> float:
    return bending_error(slenderness, DIVISIONS, order, 0.0)


CASE = CaseDefinition(
    name="linear-elements",
    title="Solid elements of degree 1: slenderness of a bar in bending",
    cause="An element with linear displacements cannot bend: its edges stay straight, and it shows "
    "shear instead of curvature. The energy of that shear grows with the square of its length over "
    "its thickness. The bar locks, and all its bending frequencies are too high. (Poisson's ratio "
    "is 0 here, so that no other locking occurs.) Elements of degree 2 can be curved. Their "
    "difference at the thick end is the shear of the bar, which the frequency of a slender beam "
    "neglects.",
    parameter="length of a bar of 20 hexahedra over its thickness", unit="",
    low=5.0, high=300.0, scale=LOG_SCALE,
    measured="error of the first frequency, relative", limit=0.1,
    method=MethodDefinition("hexahedra of degree 1", lambda x: _error(x, 1)),
    remedy=MethodDefinition("hexahedra of degree 2", lambda x: _error(x, 2)), reach=1000.0,
    source="Cook, Malkus, Plesha, Witt, Concepts and Applications of Finite Element Analysis, "
    "4th ed., 2002, ch. 3 and 6 (parasitic shear)", extra="fem",
)  # fmt: skip
