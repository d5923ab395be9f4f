"""Hinges that the looped engine sweeps as links, with kernels that know how they move."""

from __future__ import annotations

from collections.abc import Iterable

from ..records.body_records import link_kernel
from ..system import BodyRun
from .simplification import LINKS, Simplification

#: How the kernel of a link with rotor inertia is called beside that without.
_ROTOR = "_rotor"


def link_simplifications(runs: Iterable[BodyRun], names: Iterable[str]) -> list[Simplification]:
    """One for each kind of link, with the first hinge of every run of bodies (of a chain that of
    its first member)."""
    found: dict[str, list[tuple[str, int]]] = {}
    for run, name in zip(runs, names, strict=True):
        if link := link_kernel(run.alike[0]):
            found.setdefault(link, []).append((name, run.count))
    return [_of_kind(link, hinges) for link, hinges in found.items()]


def _of_kind(link: str, hinges: list[tuple[str, int]]) -> Simplification:
    kind = link.removeprefix("link_").removesuffix(_ROTOR)
    count = sum(many for _, many in hinges)
    rotor = " with rotor inertia" if link.endswith(_ROTOR) else ""
    text = (
        f'{count} {"hinge" if count == 1 else "hinges"} of type "{kind}"{rotor}: swept as links, '
        "which know how they move, by the looped engine"
    )
    return Simplification(LINKS, tuple(name for name, _ in hinges), text)
