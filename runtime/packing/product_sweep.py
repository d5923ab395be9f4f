"""Accelerations of a chain, open or with closed loops, by the product of transfer matrices.

A didactic reference, not a solver: its pivots belong to one body and may vanish, and its error
grows geometrically with the number of bodies.  Every evaluation is compared with the Riccati sweep,
and fails where the deviation exceeds the requested accuracy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.errors import SceneError

from .loops.unsupported_loops import reject_constraints

if TYPE_CHECKING:
    from mstmm.scene import Hinge

    from .packed_scene import PackedScene

#: Kinds of hinges of the C engine that have classical matrices; a chain must have a single kind.
PIN, BALL, ACCELERATION = "PIN", "BALL", "ACCELERATION"


def _kind(hinge: Hinge) -> str | None:
    """Kind of a hinge; None if there is no classical matrix."""
    facts = hinge.facts
    if facts is None or not facts.constant_subspace or (facts.slides and not facts.free_body):
        return None
    if facts.free_body:
        return ACCELERATION
    return PIN if facts.axial else BALL if len(facts.turns) == 3 else None


def enable_product_sweep(packed: PackedScene, accuracy: float) -> None:
    """Use the product sweep.  Raises SceneError for scenes without classical matrices."""
    scene, lib = packed.scene, packed.lib
    _check_supported(packed)
    packed.product = record = packed.ffi.new("mstmm_product *")
    record.kind = getattr(lib, f"MSTMM_PRODUCT_{_kind(scene.hinges[0])}")
    record.accuracy = accuracy
    # In the workspace, so that each thread has its own.
    record.place = packed.scratch
    packed.scratch += packed.system.count * int(lib.MSTMM_PRODUCT_PER_BODY) + packed.layout.nu
    loops = packed.written.loops
    packed.scratch += 0 if loops is None else (loops.count + 1) ** 2
    packed.model.product = record
    packed.model.refines = 0


def _along_chain(packed: PackedScene) -> list[Hinge]:
    """Hinges from the ground to the tip, without the cut ones.

    Raises SceneError for a tree with branches, and for loops with hinges that may be released.
    """
    frames = {closure.frame for closure in packed.system.closures}
    previous = -1
    hinges: list[Hinge] = []
    for place, link in enumerate(packed.topology.links):
        if place in frames:
            continue
        if link.parent != previous:
            cut = ", the hinges that close its loops cut (cut = true)" if frames else ""
            raise SceneError(
                "the product of transfer matrices needs an unbranched chain"
                f'{cut}; use sweep = "riccati"'
            )
        previous = place
        hinges.append(packed.scene.hinges[link.hinge])
    if frames and packed.releases:
        raise SceneError(
            "the product of transfer matrices does not support closed loops with released hinges; "
            'use sweep = "riccati"'
        )
    return hinges


def _check_supported(packed: PackedScene) -> None:
    """Raise SceneError for the first element without a classical matrix."""
    scene = packed.scene
    remedy = 'use sweep = "riccati"'
    if packed.flexible:
        name = next(iter(packed.flexible))
        raise SceneError(
            f'"{name}": sweep = "product" needs rigid bodies, found a flexible one; {remedy}'
        )
    reject_constraints(packed, 'sweep = "product"', remedy)
    hinges = _along_chain(packed)
    for hinge in hinges:
        if _kind(hinge) is None:
            raise SceneError(
                f'hinge "{hinge.name}": there is no classical matrix for the type {hinge.type}; '
                f"{remedy}"
            )
        if _kind(hinge) != _kind(hinges[0]):
            raise SceneError(
                f'hinge "{hinge.name}": type {hinge.type} outboard of type {hinges[0].type} has no '
                "classical matrix, as its condition does not determine the free accelerations "
                f"inboard of it; {remedy}"
            )
    frame_links = [packed.topology.links[closure.frame] for closure in packed.system.closures]
    frames = {scene.bodies.name(link.body) for link in frame_links}
    for body in scene.bodies:
        if body.name not in frames and (body.type != "rigid" or body.mass == 0):
            raise SceneError(
                f'body "{body.name}": the classical matrix needs a rigid body with mass; {remedy}'
            )
    for hinge in scene.hinges:
        if hinge.drive is not None or any(hinge.law.inertia):
            raise SceneError(
                f'hinge "{hinge.name}": drives and rotor inertia have no classical matrix; {remedy}'
            )
