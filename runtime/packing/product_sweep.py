"""The plain product of classical transfer matrices as a way to the accelerations of a chain, and of
loops closed on it.

A didactic reference, not a solver: its pivots belong to one body and may vanish, and its error
grows geometrically with the number of bodies.  Every evaluation is compared with the Riccati
sweep, and stops where the deviation exceeds the accuracy asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.errors import SceneError

from .loops.unsupported_loops import reject_constraints

if TYPE_CHECKING:
    from mstmm.scene import Hinge

    from .packed_scene import PackedScene

#: Kinds of the C engine for which there are classical matrices; a hinge and its successor must be
#: of one kind.
PIN, BALL, ACCELERATION = "PIN", "BALL", "ACCELERATION"


def _kind(hinge: Hinge) -> str | None:
    facts = hinge.facts
    if facts is None or not facts.steady or (facts.slides and not facts.free_body):
        return None
    if facts.free_body:
        return ACCELERATION
    return PIN if facts.axial else BALL if len(facts.turns) == 3 else None


def enable_product_sweep(packed: PackedScene, accuracy: float) -> None:
    """Let the packed scene use the product.  SceneError for a scene it has no matrices for."""
    scene, lib = packed.scene, packed.lib
    _refuse(packed)
    packed.product = record = packed.ffi.new("mstmm_product *")
    record.kind = getattr(lib, f"MSTMM_PRODUCT_{_kind(scene.hinges[0])}")
    record.accuracy = accuracy
    # Its numbers stand between the blocks and what lies behind them: one workspace per thread.
    record.place = packed.scratch
    packed.scratch += packed.system.count * int(lib.MSTMM_PRODUCT_PER_BODY) + packed.layout.nu
    loops = packed.written.loops
    packed.scratch += 0 if loops is None else (loops.count + 1) ** 2
    packed.model.product = record
    packed.model.refines = 0


def _along_chain(packed: PackedScene) -> list[Hinge]:
    """Hinges from the ground to the tip, without those that close loops on the chain.  SceneError
    for a tree with branches, and for closing hinges that let go."""
    frames = {one.frame for one in packed.system.closures}
    carried = -1
    hinges: list[Hinge] = []
    for place, link in enumerate(packed.topology.links):
        if place in frames:
            continue
        if link.parent != carried:
            cut = ", the hinges that close its loops cut (cut = true)" if frames else ""
            raise SceneError(
                "the product of transfer matrices needs an unbranched chain"
                f'{cut}; use sweep = "riccati"'
            )
        carried = place
        hinges.append(packed.scene.hinges[link.hinge])
    if frames and packed.releases:
        raise SceneError(
            "the product of transfer matrices keeps the loops of its chain closed, and hinges are "
            'released; use sweep = "riccati"'
        )
    return hinges


def _refuse(packed: PackedScene) -> None:
    """Name what the classical product has no matrix for."""
    scene = packed.scene
    way_out = 'use sweep = "riccati"'
    if packed.flexible:
        name = next(iter(packed.flexible))
        raise SceneError(f'"{name}" is flexible; the product runs rigid chains only; {way_out}')
    reject_constraints(packed, 'sweep = "product"', way_out)
    hinges = _along_chain(packed)
    for hinge in hinges:
        if _kind(hinge) is None:
            raise SceneError(
                f'hinge "{hinge.name}": there is no classical matrix for the type {hinge.type}; '
                f"{way_out}"
            )
        if _kind(hinge) != _kind(hinges[0]):
            raise SceneError(
                f'hinge "{hinge.name}": type {hinge.type} behind type {hinges[0].type} has no '
                "classical matrix: "
                f"its condition does not determine the free accelerations before it; {way_out}"
            )
    places = [packed.topology.links[one.frame] for one in packed.system.closures]
    frames = {scene.bodies.name(link.body) for link in places}
    for body in scene.bodies:
        if body.name not in frames and (body.type != "rigid" or body.mass == 0):
            raise SceneError(
                f'body "{body.name}": the classical matrix needs a rigid body with mass; {way_out}'
            )
    for joint in scene.hinges:
        if joint.drive is not None or any(joint.law.inertia):
            raise SceneError(
                f'hinge "{joint.name}": drives and rotor inertia have no matrix; {way_out}'
            )
