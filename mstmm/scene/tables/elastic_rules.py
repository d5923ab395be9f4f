"""Checks of the keys of an elastic body against each other: source, material, ends."""

from __future__ import annotations

from collections.abc import Iterator

from ..validators.scalars_and_vectors import Location
from .elastic_keys import SOURCES, ElasticKeys

Problem = tuple[Location, str]

#: Material keys of meshed bodies, with their meaning and unit.
MATERIAL_KEYS = {
    "young": "Young's modulus in Pa, more than 0",
    "poisson": "Poisson's ratio, more than -1 and less than 0.5",
    "density": "a number in kg/m^3, more than 0",
}


def problems(elastic: ElasticKeys) -> Iterator[Problem]:
    """Problems of the keys of an elastic body with each other."""
    given_sources = [key for key in SOURCES if getattr(elastic, key) is not None]
    if len(given_sources) != 1:
        sources_text = " and ".join(given_sources) if given_sources else "none"
        yield (
            (),
            f"expected exactly one of {', '.join(SOURCES)} as the source of the body, found "
            f'{sources_text}; write for example matrices = "link.npz"',
        )
        return
    yield from _material_problems(elastic, given_sources[0])
    yield from _end_problems(elastic, given_sources[0])
    yield from _start_problems(elastic)


def _material_problems(elastic: ElasticKeys, source: str) -> Iterator[Problem]:
    is_meshed = source in ("mesh", "box")
    for key, meaning in MATERIAL_KEYS.items():
        value = getattr(elastic, key)
        if is_meshed and value is None:
            yield (key,), f"missing; a body from a {source} needs {meaning}"
        elif not is_meshed and value is not None:
            yield (key,), f"{source} already contain the material; leave it out"
    if elastic.poisson is not None and not -1 < elastic.poisson < 0.5:
        yield (
            ("poisson",),
            f"expected {MATERIAL_KEYS['poisson']}, found {elastic.poisson:g}"
            + ("; no element is incompressible" if elastic.poisson == 0.5 else ""),
        )
    if elastic.order is not None and not is_meshed:
        yield ("order",), "only mesh and box have an element order; leave it out"
    if elastic.scale is not None and source != "mesh":
        yield ("scale",), "only a mesh file has its own length unit; leave it out"


def _end_problems(elastic: ElasticKeys, source: str) -> Iterator[Problem]:
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
        invalid_nodes = [n for n in end.nodes or () if nodes is not None and n >= nodes]
        if invalid_nodes:
            yield (
                ("ends", name, "nodes"),
                f"expected numbers from 0 to {(nodes or 0) - 1}, found {invalid_nodes[0]}",
            )


def _start_problems(elastic: ElasticKeys) -> Iterator[Problem]:
    """Problem of eta and etad with different lengths; the matrices determine their number."""
    start = elastic.initial
    if start.eta is not None and start.etad is not None and len(start.eta) != len(start.etad):
        yield (
            ("initial", "etad"),
            f"expected as many entries as eta, {len(start.eta)}, found {len(start.etad)}",
        )
