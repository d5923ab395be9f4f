"""Welded rigid bodies as one: their mass, mass centre and inertia together, their ends kept.

A body that is welded to another one becomes part of it.  Its origin and its ends live on as ends of
that one, under names that tell where they come from: "arm.tip" on "hub" becomes "hub.arm_tip".
What is welded to the ground becomes part of that: what hung on it hangs on the ground, where its
ends are.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from mstmm.numerics.pose import ZERO, Pose
from mstmm.numerics.rotations import Matrix, Vector, from_orientation
from mstmm.scene import Body, Chain, Hinge, Load, Scene, Spring, split_reference
from mstmm.scene.validators.scalars_and_vectors import GROUND

from ...chart.model_levels import with_tables
from ...packing.flexible.rigid_substitution import substitute_rigid_bodies
from ...packing.merging.referenced_parts import ReferencedParts, referenced_parts
from ...packing.merging.weld_geometry import (
    end_pose,
    merged_body,
    to_end,
    to_orientation,
    weld_pose,
)
from ..body_model_levels import RIGID
from ..measure_renaming import compose_names, rename_reference
from .chain_expansion import ExpandedScene, expand_chains, short
from .load_axes import with_axes_of, with_ends_at_mass_centers
from .reference_renaming import INERTIAL, with_names


@dataclass(frozen=True)
class MergedScene:
    """A scene with fewer bodies.

    Attributes:
        scene: with welded bodies as one.
        names: "arm" and "arm.tip" of the former scene -> "hub.arm", "hub.arm_tip", or "ground".
        into: body that is gone -> body that it is part of, or "ground".
        still: place of the former scene -> where it is on the ground, m.
        idle: loads and springs that are gone, for they do nothing.
        written: a sentence for each chain that was written out.
    """

    scene: Scene
    names: Mapping[str, str] = field(default_factory=dict)
    into: Mapping[str, str] = field(default_factory=dict)
    still: Mapping[str, Vector] = field(default_factory=dict)
    idle: tuple[str, ...] = ()
    written: tuple[str, ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """A sentence for every body that others became part of."""
        parts: dict[str, list[str]] = {}
        for body, whole in self.into.items():
            parts.setdefault(whole, []).append(body)
        said = [
            f"{_called(whole)}: one with {', '.join(gone)}, which are welded to it; "
            + ", ".join(self._moved(old) for old in self.names if split_reference(old)[0] in gone)
            for whole, gone in parts.items()
        ]
        return (
            *self.written,
            *said,
            *(f"{what}: left out, for it does nothing now" for what in self.idle),
        )

    def _moved(self, old: str) -> str:
        if old not in self.still:
            return f"{old} is {self.names[old]} now"
        return f"{old} is at [{', '.join(f'{x:.6g}' for x in self.still[old])}] now"


def _called(whole: str) -> str:
    return f"the {GROUND}" if whole == GROUND else f'body "{whole}"'


def merge_welds(scene: Scene, keep: Collection[str] = ()) -> MergedScene | None:
    """The scene with every weld between rigid bodies, and between these and the ground, gone; None
    where there is none.  Bodies and hinges to `keep` stay by themselves."""
    written = expand_chains(scene, [one for one in short(scene) if _welded(one, scene)])
    found = MergedScene(with_ends_at_mass_centers(_with_bodies(written.scene)))
    stays = {rename_reference(name, written.names) for name in keep}
    while True:
        spoken = referenced_parts(found.scene, stays)
        bodies = {body.name: body for body in found.scene.body}
        for weld in found.scene.hinge:
            gone = _goes(weld, bodies, found.scene, spoken)
            if gone is not None:
                break
        else:
            return _of_chains(found, written) if found.into else None
        found = _without(found, weld, gone, bodies)


def _of_chains(found: MergedScene, written: ExpandedScene) -> MergedScene:
    """What is merged of the scene as it was before its chains were written out."""
    still = {old: found.still[new] for old, new in written.names.items() if new in found.still}
    return replace(
        found, names=compose_names(written.names, found.names), still={**found.still, **still},
        written=written.words,
    )  # fmt: skip


# --- what may go ----------------------------------------------------------------------------------


def _welded(chain: Chain, scene: Scene) -> bool:
    """Whether members are welded to each other, or something is welded to one."""
    return any(hinge.is_weld for hinge in chain.hinge) or any(
        hinge.is_weld and hinge.inboard.startswith(f"{chain.name}[") for hinge in scene.hinge
    )


def _with_bodies(scene: Scene) -> Scene:
    """Flexible bodies that do not deform, welded at one end at least, as bodies."""
    ends = {
        split_reference(e)[0] for h in scene.hinge if h.is_weld for e in (h.inboard, h.outboard)
    }
    stiff = {one.name for one in (*scene.beam, *scene.elastic) if one.model == RIGID} & ends
    if not stiff:
        return scene
    made = substitute_rigid_bodies(scene, {}, stiff).scene
    slender = {"allow_unphysical_inertia": True}
    return with_tables(
        made,
        body=tuple(
            one.model_copy(update=slender) if one.name in stiff else one for one in made.body
        ),
    )


def _goes(
    weld: Hinge, bodies: Mapping[str, Body], scene: Scene, spoken: ReferencedParts
) -> str | None:
    """The body that becomes part of what a hinge welds it to; None where neither may."""
    if not weld.is_weld or weld.lets_go or weld.name in spoken.hinges:
        return None
    pair = (weld.outboard_body, weld.inboard_body)
    if any(name != GROUND and not _rigid(bodies.get(name)) for name in pair):
        return None
    if any(
        {split_reference(one.from_)[0], split_reference(one.to)[0]} == {*pair} and _own(one)
        for one in scene.spring
    ):
        return None
    if any(
        {split_reference(one.from_)[0], split_reference(one.to)[0]} & {*pair} - {GROUND}
        for one in scene.bushing
    ):
        return None  # its axes are those of its ends
    if _closes_on(weld, scene):
        return None
    if weld.inboard_body == GROUND:
        alone = len(scene.skeleton.bodies) == 1
        return None if alone or weld.outboard_body in spoken.places else weld.outboard_body
    return next((name for name in pair if name not in spoken.bodies), None)


def _closes_on(weld: Hinge, scene: Scene) -> bool:
    """Whether a loop would have both of its ends on the whole, or one on the ground that nothing
    there can be."""
    pair = {weld.outboard_body, weld.inboard_body}
    closing = [one for one in scene.hinge if one.name != weld.name]
    ends = [{one.inboard_body, one.outboard_body} for one in closing]
    ends += [
        {split_reference(one.from_)[0], split_reference(one.to)[0]} for one in scene.constraint
    ]
    if any(two == pair for two in ends):
        return True
    part = weld.outboard_body
    return weld.inboard_body == GROUND and (
        any(one.outboard_body == part for one in closing)
        or any(
            part in (split_reference(one.from_)[0], split_reference(one.to)[0])
            for one in scene.constraint
        )
    )


def _rigid(body: Body | None) -> bool:
    return body is not None and body.type == RIGID


def _own(spring: Spring) -> bool:
    """Whether it is a force element of a user's, which may push a body on its own."""
    return spring.type != "spring"


# --- one weld -------------------------------------------------------------------------------------


def _without(found: MergedScene, weld: Hinge, gone: str, bodies: Mapping[str, Body]) -> MergedScene:
    """The scene in which a body is part of what it is welded to."""
    part = bodies[gone]
    other = weld.inboard_body if gone == weld.outboard_body else weld.outboard_body
    whole = bodies.get(other)
    pose = weld_pose(weld, bodies.get(weld.inboard_body), bodies[weld.outboard_body])
    if gone != weld.outboard_body:
        pose = pose.inverse
    places = {gone: pose} | {f"{gone}.{end}": pose.then(end_pose(part, end)) for end in part.ends}
    scene = with_tables(
        found.scene, hinge=tuple(one for one in found.scene.hinge if one.name != weld.name)
    )
    scene = with_axes_of(scene, gone, INERTIAL if whole is None else whole.name, pose.rotation)
    if whole is None:
        return _grounded(found, scene, gone, places)
    return _joined(found, scene, whole, part, places)


def _joined(
    found: MergedScene, scene: Scene, whole: Body, part: Body, places: Mapping[str, Pose]
) -> MergedScene:
    """The scene in which one body is part of another."""
    ends, names = dict(whole.ends), {}
    for old, pose in places.items():
        own = _free_name(ends, old.replace(".", "_"))
        ends[own], names[old] = to_end(pose), f"{whole.name}.{own}"
    body = merged_body(whole, part, places[part.name]).model_copy(update={"ends": ends})
    made = with_names(scene, names)
    others = tuple(one for one in scene.body if one.name != part.name)
    made = with_tables(made, body=tuple(body if one.name == whole.name else one for one in others))
    return _gone(found, made, part.name, whole.name, names)


def _free_name(ends: Collection[str], name: str) -> str:
    while name in ends:
        name += "_"
    return name


def _gone(
    found: MergedScene, scene: Scene, part: str, whole: str, names: Mapping[str, str]
) -> MergedScene:
    """What is known after one more body is gone."""
    into = {body: whole if target == part else target for body, target in found.into.items()}
    former = {old: names.get(new, new) for old, new in found.names.items()}
    idle = [one for one in scene.spring if _within(one)]
    return replace(
        found,
        scene=with_tables(scene, spring=tuple(one for one in scene.spring if one not in idle)),
        names={**former, **names}, into={**into, part: whole},
        idle=(*found.idle, *(f'spring "{one.name}"' for one in idle)),
    )  # fmt: skip


def _within(spring: Spring) -> bool:
    """Whether both of its ends are on one body, or on the ground."""
    return split_reference(spring.from_)[0] == split_reference(spring.to)[0]


# --- the ground -----------------------------------------------------------------------------------


def _grounded(
    found: MergedScene, scene: Scene, gone: str, places: Mapping[str, Pose]
) -> MergedScene:
    """The scene in which a body is part of the ground."""
    idle = [load for load in scene.load if _on(load, gone)]
    made = with_tables(
        scene,
        body=tuple(one for one in scene.body if one.name != gone),
        hinge=tuple(_hung(one, one.rotation, places) for one in scene.hinge),
        chain=tuple(_hung(one, _first_turn(one), places) for one in scene.chain),
        spring=tuple(_held(one, places) for one in scene.spring),
        load=tuple(one for one in scene.load if one not in idle),
    )
    # ends of other bodies that became ends of this one are on the ground with it
    still = {old: pose.position for old, pose in places.items()}
    still |= {old: still[new] for old, new in found.names.items() if new in still}
    after = _gone(found, made, gone, GROUND, dict.fromkeys(places, GROUND))
    said = tuple(f'load "{one.name}"' for one in idle)
    return replace(after, still={**found.still, **still}, idle=(*said, *after.idle))


def _on(load: Load, body: str) -> bool:
    return split_reference(load.on)[0] == body


def _first_turn(chain: Chain) -> Matrix:
    """Rotation of the first hinge of a chain."""
    given = chain.orientation
    return chain.hinge[0].rotation if given is None else from_orientation(given)


def _hung(element: Any, rotation: Matrix, places: Mapping[str, Pose]) -> Any:
    """A hinge or a chain that hangs on the ground where the end was that it hung on."""
    if element.inboard not in places:
        return element
    held = places[element.inboard]
    return element.model_copy(
        update={
            "inboard": GROUND, "position": held.position,
            "orientation": to_orientation(held.then(Pose(ZERO, rotation))),
        }
    )  # fmt: skip


def _held(spring: Spring, places: Mapping[str, Pose]) -> Spring:
    """A spring to the place on the ground where its end was."""
    for key in ("from_", "to"):
        pose = places.get(getattr(spring, key))
        if pose is not None:
            spring = spring.model_copy(update={key: GROUND, "position": pose.position})
    return spring
