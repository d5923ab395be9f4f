"""Merge welded rigid bodies: combined mass, mass centre and inertia; their ends remain.

A body that is welded to another one becomes part of it.  Its origin and its ends become ends of
that body, named after their former body: "arm.tip" on "hub" becomes "hub.arm_tip".  A body welded
to the ground becomes part of the ground; what was attached to it is attached to the ground at the
same point.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from mstmm.numerics.rotations import ZERO, Matrix, Pose, Vector, from_orientation
from mstmm.scene import Body, Chain, Hinge, Scene, Spring, split_reference
from mstmm.scene.validators.scalars_and_vectors import GROUND

from ...packing.rigid_substitution import substitute_rigid_bodies
from ...packing.simplification import (
    ReferencedParts,
    end_pose,
    merged_body,
    referenced_parts,
    to_end,
    to_orientation,
    weld_pose,
)
from ..model_levels import with_tables
from .body_models import RIGID
from .scene_edits import (
    INERTIAL,
    ExpandedScene,
    compose_names,
    expand_chains,
    expandable_chains,
    rename_reference,
    unused_name,
    with_ends_at_mass_centers,
    with_load_axes,
    with_references,
)


@dataclass(frozen=True)
class MergedScene:
    """Scene with merged bodies.

    Attributes:
        scene: the new scene.
        names: body or end of the former scene, "arm" or "arm.tip" -> "hub.arm", "hub.arm_tip", or
            "ground".
        carriers: removed body -> body that it is part of, or "ground".
        fixed_points: body or end of the former scene -> its fixed position, m.
        idle: removed loads and springs, which have no effect any more.
        written: a sentence for each expanded chain.
    """

    scene: Scene
    names: Mapping[str, str] = field(default_factory=dict)
    carriers: Mapping[str, str] = field(default_factory=dict)
    fixed_points: Mapping[str, Vector] = field(default_factory=dict)
    idle: tuple[str, ...] = ()
    written: tuple[str, ...] = ()

    @property
    def descriptions(self) -> tuple[str, ...]:
        """Sentences on expanded chains, merged bodies, and removed loads and springs."""
        parts_by_whole: dict[str, list[str]] = {}
        for part, whole in self.carriers.items():
            parts_by_whole.setdefault(whole, []).append(part)
        merged = [
            f"{_body_text(whole)}: merged with {', '.join(parts)}, which are welded to it; "
            + ", ".join(
                self._moved_text(name) for name in self.names if split_reference(name)[0] in parts
            )
            for whole, parts in parts_by_whole.items()
        ]
        removed = [f"{element}: left out, it has no effect any more" for element in self.idle]
        return (*self.written, *merged, *removed)

    def _moved_text(self, name: str) -> str:
        if name not in self.fixed_points:
            return f"{name} is {self.names[name]} now"
        return f"{name} is at [{', '.join(f'{x:.6g}' for x in self.fixed_points[name])}] now"


def _body_text(name: str) -> str:
    return f"the {GROUND}" if name == GROUND else f'body "{name}"'


def merge_welds(scene: Scene, keep: Collection[str] = ()) -> MergedScene | None:
    """Remove all welds between rigid bodies, and to the ground; None if there are none.

    The bodies and hinges `keep` are not removed.
    """
    expanded = expand_chains(
        scene, [chain for chain in expandable_chains(scene) if _has_welds(chain, scene)]
    )
    merged = MergedScene(with_ends_at_mass_centers(_with_rigid_bodies(expanded.scene)))
    kept = {rename_reference(name, expanded.names) for name in keep}
    while True:
        referenced = referenced_parts(merged.scene, kept)
        bodies = {body.name: body for body in merged.scene.body}
        for weld in merged.scene.hinge:
            removed = _removable_body(weld, bodies, merged.scene, referenced)
            if removed is not None:
                break
        else:
            return _with_chain_names(merged, expanded) if merged.carriers else None
        merged = _remove_weld(merged, weld, removed, bodies)


def _with_chain_names(merged: MergedScene, expanded: ExpandedScene) -> MergedScene:
    """The merged scene with names that refer to the scene before its chains were expanded."""
    still = {
        old: merged.fixed_points[new]
        for old, new in expanded.names.items()
        if new in merged.fixed_points
    }
    return replace(
        merged, names=compose_names(expanded.names, merged.names),
        fixed_points={**merged.fixed_points, **still}, written=expanded.descriptions,
    )  # fmt: skip


# --- which bodies can be removed ----------------------------------------------------------------


def _has_welds(chain: Chain, scene: Scene) -> bool:
    """Whether members of a chain are welded to each other, or something is welded to one."""
    return any(hinge.is_weld for hinge in chain.hinge) or any(
        hinge.is_weld and hinge.inboard.startswith(f"{chain.name}[") for hinge in scene.hinge
    )


def _with_rigid_bodies(scene: Scene) -> Scene:
    """The scene with rigid beams and elastic bodies that have a weld replaced by rigid bodies."""
    welded = {
        split_reference(reference)[0]
        for hinge in scene.hinge
        if hinge.is_weld
        for reference in (hinge.inboard, hinge.outboard)
    }
    rigid = {body.name for body in (*scene.beam, *scene.elastic) if body.model == RIGID} & welded
    if not rigid:
        return scene
    substituted = substitute_rigid_bodies(scene, {}, rigid).scene
    update = {"allow_unphysical_inertia": True}  # a beam has no inertia about its axis
    return with_tables(
        substituted,
        body=tuple(
            body.model_copy(update=update) if body.name in rigid else body
            for body in substituted.body
        ),
    )


def _removable_body(
    weld: Hinge, bodies: Mapping[str, Body], scene: Scene, referenced: ReferencedParts
) -> str | None:
    """Body of a weld that can become part of the other one; None if neither can."""
    if not weld.is_weld or weld.is_released or weld.name in referenced.hinges:
        return None
    pair = (weld.outboard_body, weld.inboard_body)
    if any(name not in bodies or bodies[name].type != RIGID for name in {*pair} - {GROUND}):
        return None
    # User-defined force elements may act between ends of one body.
    if any(_end_bodies(s) == {*pair} and s.type != "spring" for s in scene.spring):
        return None
    if any(_end_bodies(bushing) & {*pair} - {GROUND} for bushing in scene.bushing):
        return None  # the axes of a bushing are those of its ends
    if _spoils_loop(weld, scene):
        return None
    if weld.inboard_body == GROUND:
        is_last = len(scene.skeleton.bodies) == 1
        return None if is_last or weld.outboard_body in referenced.frames else weld.outboard_body
    return next((name for name in pair if name not in referenced.bodies), None)


def _end_bodies(element: Any) -> set[str]:
    """Bodies at the two ends of a spring, bushing or constraint."""
    return {split_reference(element.from_)[0], split_reference(element.to)[0]}


def _spoils_loop(weld: Hinge, scene: Scene) -> bool:
    """Whether merging spoils a loop: both ends on one body, or outboard end on the ground."""
    pair = {weld.outboard_body, weld.inboard_body}
    other_hinges = [hinge for hinge in scene.hinge if hinge.name != weld.name]
    end_bodies = [{hinge.inboard_body, hinge.outboard_body} for hinge in other_hinges]
    end_bodies += [_end_bodies(constraint) for constraint in scene.constraint]
    if pair in end_bodies:
        return True
    part = weld.outboard_body
    return weld.inboard_body == GROUND and (
        any(hinge.outboard_body == part for hinge in other_hinges)
        or any(part in _end_bodies(constraint) for constraint in scene.constraint)
    )


# --- removal of one weld ------------------------------------------------------------------------


def _remove_weld(
    merged: MergedScene, weld: Hinge, removed: str, bodies: Mapping[str, Body]
) -> MergedScene:
    """Remove a weld and one of its bodies, which becomes part of the other one."""
    part = bodies[removed]
    other = weld.inboard_body if removed == weld.outboard_body else weld.outboard_body
    whole = bodies.get(other)
    pose = weld_pose(weld, bodies.get(weld.inboard_body), bodies[weld.outboard_body])
    if removed != weld.outboard_body:
        pose = pose.inverse
    poses = {removed: pose} | {
        f"{removed}.{end}": pose.compose(end_pose(part, end)) for end in part.ends
    }
    scene = with_tables(
        merged.scene, hinge=tuple(hinge for hinge in merged.scene.hinge if hinge.name != weld.name)
    )
    scene = with_load_axes(scene, removed, INERTIAL if whole is None else whole.name, pose.rotation)
    if whole is None:
        return _merge_into_ground(merged, scene, removed, poses)
    return _merge_into_body(merged, scene, whole, part, poses)


def _merge_into_body(
    merged: MergedScene, scene: Scene, whole: Body, part: Body, poses: Mapping[str, Pose]
) -> MergedScene:
    """Merge a body into another one; `poses` are those of its origin and ends in that body."""
    ends, names = dict(whole.ends), {}
    for old, pose in poses.items():
        end = unused_name(old.replace(".", "_"), ends)
        ends[end], names[old] = to_end(pose), f"{whole.name}.{end}"
    body = merged_body(whole, part, poses[part.name]).model_copy(update={"ends": ends})
    renamed = with_references(scene, names)
    bodies = tuple(
        body if other.name == whole.name else other
        for other in scene.body
        if other.name != part.name
    )
    return _record_removal(merged, with_tables(renamed, body=bodies), part.name, whole.name, names)


def _record_removal(
    merged: MergedScene, scene: Scene, part: str, whole: str, names: Mapping[str, str]
) -> MergedScene:
    """The merged scene after one more body has been removed."""
    into = {body: whole if target == part else target for body, target in merged.carriers.items()}
    former = {old: names.get(new, new) for old, new in merged.names.items()}
    idle = [spring for spring in scene.spring if len(_end_bodies(spring)) == 1]
    return replace(
        merged,
        scene=with_tables(scene, spring=tuple(s for s in scene.spring if s not in idle)),
        names={**former, **names}, carriers={**into, part: whole},
        idle=(*merged.idle, *(f'spring "{spring.name}"' for spring in idle)),
    )  # fmt: skip


# --- merging into the ground --------------------------------------------------------------------


def _merge_into_ground(
    merged: MergedScene, scene: Scene, removed: str, poses: Mapping[str, Pose]
) -> MergedScene:
    """Merge a body into the ground; `poses` are those of its origin and ends on the ground."""
    idle = [load for load in scene.load if split_reference(load.on)[0] == removed]
    changed = with_tables(
        scene,
        body=tuple(body for body in scene.body if body.name != removed),
        hinge=tuple(_attached_to_ground(hinge, hinge.rotation, poses) for hinge in scene.hinge),
        chain=tuple(
            _attached_to_ground(
                chain,
                chain.hinge[0].rotation
                if chain.orientation is None
                else from_orientation(chain.orientation),
                poses,
            )
            for chain in scene.chain
        ),
        spring=tuple(_spring_to_ground(spring, poses) for spring in scene.spring),
        load=tuple(load for load in scene.load if load not in idle),
    )
    # Ends of other bodies that became ends of this one are fixed on the ground, too.
    still = {old: pose.position for old, pose in poses.items()}
    still |= {old: still[new] for old, new in merged.names.items() if new in still}
    names = dict.fromkeys(poses, GROUND)
    after = _record_removal(merged, changed, removed, GROUND, names)
    idle_loads = tuple(f'load "{load.name}"' for load in idle)
    return replace(
        after, fixed_points={**merged.fixed_points, **still}, idle=(*idle_loads, *after.idle)
    )


def _attached_to_ground(element: Any, rotation: Matrix, poses: Mapping[str, Pose]) -> Any:
    """A hinge or chain whose inboard end moves to the ground, at the same pose."""
    if element.inboard not in poses:
        return element
    pose = poses[element.inboard]
    return element.model_copy(
        update={
            "inboard": GROUND, "position": pose.position,
            "orientation": to_orientation(pose.compose(Pose(ZERO, rotation))),
        }
    )  # fmt: skip


def _spring_to_ground(spring: Spring, poses: Mapping[str, Pose]) -> Spring:
    """A spring whose end moves to the ground, at the same point."""
    for key in ("from_", "to"):
        pose = poses.get(getattr(spring, key))
        if pose is not None:
            spring = spring.model_copy(update={key: GROUND, "position": pose.position})
    return spring
