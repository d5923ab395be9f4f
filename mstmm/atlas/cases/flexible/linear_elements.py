"""Solid elements of degree 1 in ever more slender bars."""

from __future__ import annotations

from ...definition import Definition, Method
from ...measures import bending_error
from ...scale import LOG

DIVISIONS = (20, 1, 1)


def _error(slenderness: float, order: int) -> float:
    return bending_error(slenderness, DIVISIONS, order, 0.0)


CASE = Definition(
    name="linear-elements",
    title="Solid elements of degree 1: slenderness of a bar in bending",
    why="An element whose displacements are linear cannot bend: its edges stay straight, and in "
    "place of curvature it shows shear, whose energy grows with the square of its length over its "
    "thickness. The bar locks, as stiff as its mesh is long, and every frequency of bending is too "
    "high. (Poisson's ratio is 0 here, so that nothing else locks.) Of degree 2 an element can be "
    "curved; what it differs by at the thick end is the bar's own shear, which the frequency of a "
    "slender beam does not hold.",
    parameter="length of a bar of 20 hexahedra over its thickness", unit="",
    low=5.0, high=300.0, scale=LOG,
    measured="error of the first frequency, relative", limit=0.1,
    method=Method("hexahedra of degree 1", lambda x: _error(x, 1)),
    remedy=Method("hexahedra of degree 2", lambda x: _error(x, 2)), reach=1000.0,
    source="Cook, Malkus, Plesha, Witt, Concepts and Applications of Finite Element Analysis, "
    "4th ed., 2002, ch. 3 and 6 (parasitic shear)", extra="fem",
)  # fmt: skip
