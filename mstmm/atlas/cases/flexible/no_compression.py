"""Solid elements of degree 1 in nearly incompressible material."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import bending_error
from ...parameter_scale import LOG_SCALE

SLENDERNESS = 10.0
#: Numbers of hexahedra along the bar and across it; the finer mesh is the one that locks.
LINEAR_MESH, QUADRATIC_MESH = (30, 3, 3), (20, 1, 1)


CASE = CaseDefinition(
    name="no-compression",
    title="Solid elements of degree 1: nearly incompressible material",
    cause="Near a Poisson's ratio of 1/2 every integration point constrains the volume around it. "
    "A mesh of degree 1 has fewer displacements than such constraints: rubber locks in every "
    "direction, whatever the shape of its elements. A mesh of degree 2 has enough displacements to "
    "bend; its error of 3 % at the incompressible end halves with the element size.",
    parameter="distance of Poisson's ratio from 1/2", unit="", low=1e-8, high=0.4, scale=LOG_SCALE,
    measured="error of the first frequency, relative", limit=0.1,
    method=MethodDefinition(
        "degree 1, 30 x 3 x 3 hexahedra",
        lambda d: bending_error(SLENDERNESS, LINEAR_MESH, 1, 0.5 - d),
    ),
    remedy=MethodDefinition(
        "degree 2, 20 x 1 x 1 hexahedra",
        lambda d: bending_error(SLENDERNESS, QUADRATIC_MESH, 2, 0.5 - d),
    ),
    reach=1e-10,
    source="Hughes, The Finite Element Method, 1987, ch. 4 (volumetric locking, counts of "
    "constraints)", extra="fem",
)  # fmt: skip
