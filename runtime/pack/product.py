"""The plain product of classical transfer matrices as a way to the accelerations of a chain.

A didactic reference, not a solver: its pivots belong to one body and may vanish, and its error
grows geometrically with the number of bodies.  Every evaluation is compared with the Riccati
sweep, and stops where the deviation exceeds the accuracy asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.errors import SceneError

from .loops.refusal import refuse

if TYPE_CHECKING:
    from mstmm.scene import Hinge

    from .packed import Packed

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


def attach(packed: Packed, accuracy: float) -> None:
    """Let the packed scene use the product.  SceneError for a scene it has no matrices for."""
    scene, lib = packed.scene, packed.lib
    refuse(packed, 'sweep = "product"', 'use sweep = "riccati"')
    _refuse(packed)
    packed.product = record = packed.ffi.new("mstmm_product *")
    record.kind = getattr(lib, f"MSTMM_PRODUCT_{_kind(scene.hinges[0])}")
    record.accuracy = accuracy
    # Its numbers stand between the blocks and what lies behind them: one workspace per thread.
    record.place = packed.scratch
    packed.scratch += len(scene.bodies) * int(lib.MSTMM_PRODUCT_PER_BODY) + packed.layout.nu
    packed.model.product = record


def _refuse(packed: Packed) -> None:
    """Name what the classical product has no matrix for."""
    scene = packed.scene
    way_out = 'use sweep = "riccati"'
    if packed.flexible:
        name = next(iter(packed.flexible))
        raise SceneError(f'"{name}" is flexible; the product runs rigid chains only; {way_out}')
    if not packed.topology.is_chain:
        raise SceneError(f"the product of transfer matrices needs an unbranched chain; {way_out}")
    hinges = [scene.hinges[link.hinge] for link in packed.topology.links]
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
    for body in scene.bodies:
        if body.type != "rigid" or body.mass == 0:
            raise SceneError(
                f'body "{body.name}": the classical matrix needs a rigid body with mass; {way_out}'
            )
    for joint in scene.hinges:
        if joint.drive is not None or any(joint.law.inertia):
            raise SceneError(
                f'hinge "{joint.name}": drives and rotor inertia have no matrix; {way_out}'
            )
