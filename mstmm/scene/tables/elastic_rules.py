"""Checks of the keys of an elastic body against each other: source, material, ends."""

from __future__ import annotations

from collections.abc import Iterator

from ..rules.values import Location
from .elastic_keys import SOURCES, ElasticKeys

Problem = tuple[Location, str]

#: Material keys of meshed bodies, with their meaning and unit.
MATERIAL = {
    "young": "Young's modulus in Pa, more than 0",
    "poisson": "Poisson's ratio, more than -1 and less than 0.5",
    "density": "a number in kg/m^3, more than 0",
}


def problems(elastic: ElasticKeys) -> Iterator[Problem]:
    """Problems of the keys of an elastic body with each other."""
    given = [key for key in SOURCES if getattr(elastic, key) is not None]
    if len(given) != 1:
        named = " and ".join(given) if given else "none"
        yield (
            (),
            f"expected exactly one of {', '.join(SOURCES)} as the source of the body, found "
            f'{named}; write for example matrices = "link.npz"',
        )
        return
    yield from _material(elastic, given[0])
    yield from _ends(elastic, given[0])
    yield from _start(elastic)


def _material(elastic: ElasticKeys, source: str) -> Iterator[Problem]:
    meshed = source in ("mesh", "box")
    for key, meaning in MATERIAL.items():
        value = getattr(elastic, key)
        if meshed and value is None:
            yield (key,), f"missing; a body from a {source} needs {meaning}"
        elif not meshed and value is not None:
            yield (key,), f"{source} already contain the material; leave it out"
    if elastic.poisson is not None and not -1 < elastic.poisson < 0.5:
        yield (
            ("poisson",),
            f"expected {MATERIAL['poisson']}, found {elastic.poisson:g}"
            + ("; no element is incompressible" if elastic.poisson == 0.5 else ""),
        )
    if elastic.order is not None and not meshed:
        yield ("order",), "only mesh and box have an element order; leave it out"
    if elastic.scale is not None and source != "mesh":
        yield ("scale",), "only a mesh file has its own length unit; leave it out"


def _ends(elastic: ElasticKeys, source: str) -> Iterator[Problem]:
    if not elastic.ends:
        yield (
            ("ends",),
            "missing; an elastic body connects only at its ends; write for example "
            "ends = { root = { plane = [1, 0, 0, 0.0] } }",
        )
    nodes = len(elastic.arrays.nodes) if elastic.arrays is not None else None
    for name, end in elastic.ends.items():
        if end.set is not None and source != "mesh":
            yield (
                ("ends", name, "set"),
                "only a mesh file has named surfaces; use plane, box, sphere or nodes",
            )
        beyond = [n for n in end.nodes or () if nodes is not None and n >= nodes]
        if beyond:
            yield (
                ("ends", name, "nodes"),
                f"expected numbers from 0 to {(nodes or 0) - 1}, found {beyond[0]}",
            )


def _start(elastic: ElasticKeys) -> Iterator[Problem]:
    """Problem of eta and etad with different lengths; the matrices determine their number."""
    start = elastic.initial
    if start.eta is not None and start.etad is not None and len(start.eta) != len(start.etad):
        yield (
            ("initial", "etad"),
            f"expected as many entries as eta, {len(start.eta)}, found {len(start.etad)}",
        )
