"""Construction of the system of a scene: topology, layout, internal frames and numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from mstmm.expression.derivatives import Inputs
from mstmm.expression.expression import Expression
from mstmm.ir import Port
from mstmm.ir.hinge_properties import Param, builtin_hinges
from mstmm.scene import Hinge, Scene, split_reference
from mstmm.scene.checks.topology import Topology, build_topology, may_have_loops
from mstmm.scene.tables.hinge import HingeTable
from mstmm.scene.tables.loads import Load

from ..discontinuities.active_expressions import active_expressions
from ..flexible.modal_body import ModalBody
from ..kernels.prebuilt_kernels import Elements, Known
from .applied_laws import force_element_numbers, law_runs
from .bodies import LETS_GO, Bodies, kernel_type
from .closures import closure_numbers, coupling_numbers
from .coordinate_layout import Group, HingeSlots, Layout
from .expansion import ExpandedScene, curve_elements, expansion_of
from .expression_tapes import MOVING, Values, drive_kernel
from .packed_scene import Frames, Lookup, releasable_hinges
from .records.body_records import link_kernel
from .simplification import (
    LINKED,
    LINKS,
    TURNS,
    WELDS,
    Simplification,
    SimplifyOptions,
    WeldedBodies,
    contract_tree,
    find_welded_bodies,
    with_right_angles,
)
from .system import BodyRun, HeldInputs, LoadNumbers, Numbers, System


def system_of(
    scene: Scene,
    known: Known | None = None,
    *,
    align: bool = True,
    flexible: Mapping[str, ModalBody] | None = None,
    moving: Mapping[int, Any] | None = None,
    simplify: SimplifyOptions = LINKED,
) -> tuple[System, Frames]:
    """Build the system of a scene, and the positions of all its parts.

    `known` are elements in addition to the prebuilt ones.  Without `align` internal frames depend
    on the body's own hinge only, and are smooth functions of the scene's numbers.  `flexible` are
    all modal bodies if they are known already, `moving` the numbers of the port "moving".
    `simplify` are the options of `simplification`.

    Raises SceneError for hinges that do not form a tree, and for unknown types.
    """
    expanded, simplifications = _with_right_angles(expansion_of(scene, flexible), simplify)
    elements = Elements({**(known or {}), **curve_elements(scene.constraint)})
    nodes, tree = expanded.scene, build_topology(expanded.scene)
    carried = find_welded_bodies(expanded, tree) if WELDS in simplify else WeldedBodies()
    tree = contract_tree(tree, carried)
    releases = {name: i for i, name in enumerate(releasable_hinges(scene))}
    layout = _build_layout(expanded, releases, elements)
    bodies = Bodies(expanded, tree, layout, elements, releases, align, LINKS in simplify, carried)
    runs = tuple(map(bodies.run, tree.runs))
    if not may_have_loops(scene):
        simplifications += _link_simplifications(
            runs, (nodes.hinges.name(run.hinge) for run in tree.runs)
        )
    frames = Frames(
        nodes, tree, layout, elements, releases, Lookup(nodes.bodies, bodies.placement),
        Lookup(nodes.bodies, tree.position_of_body), Lookup(nodes.hinges, tree.position_of_hinge),
        expanded, (*carried.simplifications(nodes), *simplifications), simplify,
    )  # fmt: skip
    ports = [Port(MOVING, (1 + max(moving),))] if moving else []
    driven, values = list(_driven_coordinates(nodes, tree)), Values(layout, ports)
    n_memory = len(releases) + sum(event.do == "bounce" for event in scene.events)
    strained = n_memory if may_have_loops(scene) else -1
    n_memory += strained >= 0
    laws = tuple(law_runs(nodes, tree, layout, values, n_memory))
    loads = tuple(_load_numbers(frames, load, values) for load in nodes.load)
    held = _held_inputs(scene, laws[-1].next_angle_index if laws else n_memory)
    loops: list[Any] = [(), (), None]
    if expanded.cuts or scene.coupling:
        loops = [tuple(closure_numbers(frames, runs)), *coupling_numbers(frames, runs)]
    system = System(
        layout.nq, layout.nu, held.first + len(held.start), strained, nodes.gravity, runs,
        laws, loads, force_element_numbers(frames, nodes, ports),
        values.kernel() if len(values) else None,
        drive_kernel([drive for _, _, drive in driven], layout, ports) if driven else None,
        tuple((place, k) for place, k, _ in driven), tuple(scene.channels.values()),
        held, has_timed_loads(nodes, nodes.channels), moving or {},
        *loops,
    )  # fmt: skip
    return system, frames


def _with_right_angles(
    expanded: ExpandedScene, simplify: SimplifyOptions
) -> tuple[ExpandedScene, list[Simplification]]:
    if TURNS not in simplify:
        return expanded, []
    scene, changes = with_right_angles(expanded.scene, simplify[TURNS])
    return (replace(expanded, scene=scene) if changes else expanded), changes


def _held_inputs(scene: Scene, first: int) -> HeldInputs:
    """Inputs that controllers set, in memory from index `first` on.

    For each controller: the number of its next sample (NaN at the start), its state, its outputs.
    """
    places, start = dict.fromkeys(scene.channels, -1), list[float]()
    for controller in scene.controller:
        start += [math.nan, *controller.complete_matrices["initial"]]
        for name in controller.outputs:
            places[name] = first + len(start)
            start.append(scene.channels[name].value(0.0))
    return HeldInputs(first, tuple(places.values()), tuple(start))


def has_timed_loads(scene: Scene, inputs: Inputs) -> bool:
    """Whether an effort or load depends on time, or on an input that is not constant."""
    active = (a for a in active_expressions(scene) if not (a.drive or a.condition))
    names = {name.text for load in active for name in load.expression.names}
    return "t" in names or any(not inputs[name].is_constant for name in names & inputs.keys())


def _driven_coordinates(scene: Scene, tree: Topology) -> Iterator[tuple[int, int, Expression]]:
    """(position of the body, coordinate, drive) of all driven coordinates."""
    for place, hinge in _driven_hinges(scene, tree):
        for k, entry in enumerate(hinge.drive or ()):
            if entry is not None:
                yield place, k, entry


def _driven_hinges(scene: Scene, tree: Topology) -> Iterator[tuple[int, HingeTable]]:
    """(position in the tree, table) of all hinges with a drive."""
    single_hinges = len(scene.hinge)
    for run in tree.runs:
        if run.hinge < single_hinges:
            if scene.hinge[run.hinge].drive is not None:
                yield run.position, scene.hinge[run.hinge]
            continue
        chain = scene.chain[scene.hinges.member(run.hinge)[0]]
        if any(table.drive is not None for table in chain.hinge):
            for k in range(run.count):
                yield run.position + k, chain.hinge_of(k)


def _load_numbers(frames: Frames, load: Load, values: Values) -> LoadNumbers:
    body, _, offset = frames.end(load.on)
    if load.at is not None:
        offset = frames.mass_center(load.on)
    name = split_reference(load.on)[0] if load.axes == "body" else load.axes
    reference = "ground" if load.axes == "inertial" else name
    axes, own, _ = frames.end(reference)
    return LoadNumbers(
        body, axes, _section_axes(frames, reference) or own, offset,
        tuple(map(values.value_index, load.force)), tuple(map(values.value_index, load.moment)),
    )  # fmt: skip


def _section_axes(frames: Frames, reference: str) -> Numbers:
    """Undeformed axes (9) of a section of a flexible body in those of its node; else empty."""
    node = frames.expanded.nodes.get(reference)
    passage = frames.expanded.passages.get(node or "")
    return () if passage is None else tuple(passage.port.rotation.T.ravel().tolist())


# --- layout of q and u ----------------------------------------------------------------------------


def _build_layout(
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
            slots.append(_hinge_slots(hinge, releases, elements, q + nq, u + nu))
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


def _hinge_slots(
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


def _names_and_units(entries: Sequence[Param]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return tuple(entry.name for entry in entries), tuple(entry.unit for entry in entries)


# --- links ----------------------------------------------------------------------------------------

#: Suffix of the kernel name of a link with rotor inertia.
_ROTOR = "_rotor"


def _link_simplifications(runs: Iterable[BodyRun], names: Iterable[str]) -> list[Simplification]:
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
