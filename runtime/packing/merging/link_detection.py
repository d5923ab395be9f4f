"""Hinges that the looped engine sweeps as links, by kernels for their type of motion."""

from __future__ import annotations

from collections.abc import Iterable

from ..records.body_records import link_kernel
from ..system import BodyRun
from .simplification import LINKS, Simplification

#: Suffix of the kernel name of a link with rotor inertia.
_ROTOR = "_rotor"


def link_simplifications(runs: Iterable[BodyRun], names: Iterable[str]) -> list[Simplification]:
    """One record per kind of link, with the first hinge of every run; `names` are these hinges."""
    hinges_by_kernel: dict[str, list[tuple[str, int]]] = {}
    for run, name in zip(runs, names, strict=True):
        if kernel := link_kernel(run.members[0]):
            hinges_by_kernel.setdefault(kernel, []).append((name, run.count))
    return [_simplification(kernel, hinges) for kernel, hinges in hinges_by_kernel.items()]


def _simplification(kernel: str, hinges: list[tuple[str, int]]) -> Simplification:
    kind = kernel.removeprefix("link_").removesuffix(_ROTOR)
    count = sum(run_count for _, run_count in hinges)
    rotor = " with rotor inertia" if kernel.endswith(_ROTOR) else ""
    text = (
        f'{count} {"hinge" if count == 1 else "hinges"} of type "{kind}"{rotor}: computed by the '
        "looped engine with kernels for this type of motion (links)"
    )
    return Simplification(LINKS, tuple(name for name, _ in hinges), text)
