"""Construction of the layout of q and u from a scene of nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.ir.param import Param
from mstmm.scene import Hinge

from .coordinate_layout import Group, HingeSlots, Layout
from .flexible.expansion import ExpandedScene
from .scene_elements import LETS_GO, Elements, kernel_type

Texts = tuple[str, ...]


def build_layout(
    expanded: ExpandedScene, releases: Mapping[str, int], elements: Elements
) -> Layout:
    """Build the layout of q and u: the scene's hinges, those of its chains, then the modes."""
    scene = expanded.scene
    groups: list[Group] = []
    q = u = 0
    starts = [*range(len(scene.hinge)), *scene.hinges.starts[:-1]]
    counts = [1] * len(scene.hinge) + [chain.count for chain in scene.chain]
    patterns = [1] * len(scene.hinge) + [len(chain.hinge) for chain in scene.chain]
    for first, count, pattern in zip(starts, counts, patterns, strict=True):
        slots, nq, nu = [], 0, 0
        for hinge in scene.hinges[first : first + pattern]:
            slots.append(_slots(hinge, releases, elements, q + nq, u + nu))
            nq, nu = nq + slots[-1].nq, nu + slots[-1].nu
        groups.append(Group(first, count, tuple(slots), nq, nu))
        repeats, rest = divmod(count, pattern)
        q += repeats * nq + sum(s.nq for s in slots[:rest])
        u += repeats * nu + sum(s.nu for s in slots[:rest])
    modal = {}
    for name, body in expanded.bodies.items():
        n = len(body.modes)
        units = tuple("rad" if mode.startswith("twist") else "m" for mode in body.modes)
        rates = tuple(f"{unit}/s" for unit in units)
        speeds = tuple(f"{mode}_rate" for mode in body.modes)
        modal[name] = HingeSlots(
            name, "modes", q, u, body.modes, units, speeds, rates, None, True, True, False
        )  # fmt: skip
        q, u = q + n, u + n
    internal = range(len(expanded.user_scene.hinge), len(scene.hinge))
    return Layout(scene, tuple(groups), q, u, modal, internal, expanded.user_scene.channels)


def _slots(
    hinge: Hinge, releases: Mapping[str, int], elements: Elements, q: int, u: int
) -> HingeSlots:
    runs_as = kernel_type(hinge, releases)
    elements.get("hinge", runs_as, hinge.name)
    facts = builtin_hinges()[LETS_GO] if hinge.is_weld and runs_as == LETS_GO else hinge.facts
    assert facts is not None  # `get` has rejected unknown types
    return HingeSlots(
        hinge.name, hinge.type, q, u, *_names_and_units(facts.coordinates),
        *_names_and_units(facts.speeds), facts.quaternion, facts.straight, facts.constant_subspace,
        facts.constant_subspace and not facts.slides,
    )  # fmt: skip


def _names_and_units(entries: Sequence[Param]) -> tuple[Texts, Texts]:
    return tuple(entry.name for entry in entries), tuple(entry.unit for entry in entries)
