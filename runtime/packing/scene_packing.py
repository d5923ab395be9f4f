"""Packing of a scene, and the sweeps and methods that support some scenes only.

The product of transfer matrices is a didactic reference, not a solver: its pivots belong to one
body and may vanish, and its error grows geometrically with the number of bodies.  Every evaluation
is compared with the Riccati sweep, and fails where the deviation exceeds the requested accuracy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.graph.closure_plan import ClosurePlan
from mstmm.scene import Scene
from mstmm.scene.checks.topology import build_topology
from mstmm.scene.tables.closures import ROLLING
from mstmm.scene.tables.scene_tables import SceneTables

from ..flexible.modal_body import ModalBody
from ..integrate.steppers import EXPLICIT_METHODS, INDEX3_SUFFIX
from ..kernels import prebuilt_kernels
from ..kernels.prebuilt_kernels import Known
from .packed_scene import Frames, PackedScene, enable_refinement, resize_workspace
from .records.model_record import write_model
from .simplification import LINKED, WELDS, SimplifyOptions
from .system import System
from .system_builder import system_of

if TYPE_CHECKING:
    from mstmm.scene import Hinge

    from .packed_scene import PackedScene
    from .system import BodyNumbers


def pack(
    scene: Scene,
    known: Known | None = None,
    product_accuracy: float | None = None,
    *,
    sweep: str = "riccati",
    align: bool = True,
    flexible: Mapping[str, ModalBody] | None = None,
    simplify: SimplifyOptions = LINKED,
) -> PackedScene:
    """Pack a scene; arguments as in `system_of`.

    With `product_accuracy` accelerations come from the product of classical matrices, which may
    deviate from the Riccati sweep by at most that.  With `sweep` "qr" they come from the QR sweep,
    with "refined" from the Riccati sweep with one refinement.
    """
    system, frames = system_of(scene, known, align=align, flexible=flexible, simplify=simplify)
    packed = packed_system(system, frames)
    if (
        product_accuracy is not None and not system.has_loops
    ):  # with loops, it follows their analysis
        enable_product_sweep(packed, product_accuracy)
    if sweep == "qr":
        enable_qr_sweep(packed)
    if sweep == "refined":
        enable_refinement(packed, 1)
    resize_workspace(packed, packed.written.slots)
    return packed


def without_merging(packed: PackedScene) -> PackedScene:
    """Pack again without merging welded bodies; inputs, state and memory are the same."""
    if not any(record.kind == WELDS for record in packed.simplified):
        return packed
    simplify = {kind: value for kind, value in packed.simplify.items() if kind != WELDS}
    system, frames = system_of(
        packed.user_scene, packed.elements.known, flexible=packed.modal, simplify=simplify
    )
    current = packed.system
    couplings = tuple(
        replace(coupling, constant=other.constant, repeats=other.repeats)
        for coupling, other in zip(system.couplings, current.couplings, strict=True)
    )
    closures = tuple(
        replace(closure, directions=other.directions, choice=other.choice)
        for closure, other in zip(system.closures, current.closures, strict=True)
    )
    system = replace(
        system, inputs=current.inputs, held_inputs=current.held_inputs,
        depends_on_time=current.depends_on_time, n_memory=current.n_memory, couplings=couplings,
        closures=closures,
    )  # fmt: skip
    unmerged = packed_system(system, frames)
    unmerged.held_input_names = packed.held_input_names
    if packed.qr:
        enable_qr_sweep(unmerged)
    if packed.refined:
        enable_refinement(unmerged, int(packed.model.refines))
    resize_workspace(unmerged, unmerged.written.slots)
    return unmerged


def packed_system(system: System, frames: Frames) -> PackedScene:
    """Pack a system, such as a variant of that of the scene."""
    ffi, lib = prebuilt_kernels.module()
    written = write_model(system, frames.elements)
    frame_fields = {field.name: getattr(frames, field.name) for field in fields(Frames)}
    packed = PackedScene(
        **frame_fields, system=system, ffi=ffi, lib=lib, model=written.model, written=written,
        scratch=written.scratch,
    )  # fmt: skip
    resize_workspace(packed, written.slots)  # tapes of events are added later and may need more
    return packed


# --- methods that do not support closed loops -----------------------------------------------------


def _loop_label(scene: SceneTables, plan: ClosurePlan) -> str:
    """Name of the first loop: its hinges, or the constraint or coupling that closes it."""
    if not plan.cut:
        for constraint in scene.constraint[:1]:
            return f'loop of constraint "{constraint.name}"'
        return f'loop of coupling "{scene.coupling[0].name}"'
    hinges = plan.loop(plan.cut[0])
    names = " - ".join(scene.hinges.name(hinge) for hinge in hinges[:_MAX_NAMED])
    return f'loop "{names}{" ..." if len(hinges) > _MAX_NAMED else ""}"'


def reject_loops(packed: PackedScene, what: str, instead: str) -> None:
    """Raise SceneError if there are closed loops: `what` does not support them; use `instead`."""
    if not packed.system.has_loops:
        return
    scene = packed.user_scene.skeleton
    plan = build_topology(scene).plan
    assert plan is not None
    raise SceneError(
        f"scene: {what} does not support closed loops, found {_loop_label(scene, plan)}; {instead}"
    )


def reject_speed_constraints(packed: PackedScene, method: str) -> None:
    """Raise SceneError if there are constraints on speeds, for a method on positions."""
    scene = packed.user_scene
    names = [f'coupling "{c.name}"' for c in scene.coupling if c.speeds is not None]
    names += [f'constraint "{c.name}"' for c in scene.constraint if c.type == ROLLING]
    if names:
        raise SceneError(
            f'scene: method "{method}" needs constraints on positions, found {names[0]} on speeds; '
            f"use {method.removesuffix(INDEX3_SUFFIX)}"
        )


def reject_constraints(packed: PackedScene, what: str, instead: str) -> None:
    """Raise SceneError if there are constraints or couplings, which `what` does not support."""
    scene = packed.user_scene
    names = [f'coupling "{coupling.name}"' for coupling in scene.coupling]
    names += [f'constraint "{constraint.name}"' for constraint in scene.constraint]
    if names:
        raise SceneError(
            f"scene: {what} does not support constraints and couplings, found {names[0]}; {instead}"
        )


#: Largest number of hinges named in a message about a loop.
_MAX_NAMED = 8
#: Methods without a formulation for closed loops: increments of loads, exponential integrators.
_METHODS_OF_TREES = ("dttmm", "exprb32")


def reject_loop_method(packed: PackedScene, method: str, tangent: str) -> None:
    """Raise SceneError for closed loops that the method or the tangent does not support."""
    if method in _METHODS_OF_TREES:
        reject_loops(packed, f'method "{method}"', "genalpha and rodas4p2 do")
    if tangent == "laws":
        reject_loops(packed, 'tangent = "laws"', 'use tangent = "exact"')


# --- QR sweep (least squares) of a tree of rigid bodies -------------------------------------------

#: Eigenvalue of a mass matrix with unit diagonal below which it counts as negative.
_NEGATIVE = -1e-11

_UPPER = np.triu_indices(6)


def enable_qr_sweep(packed: PackedScene) -> None:
    """Use the QR sweep.

    Raises SceneError for closed loops, flexible bodies, and mass matrices that are indefinite.
    """
    remedy = 'use sweep = "riccati"'
    reject_loops(packed, 'sweep = "qr"', remedy)
    if packed.flexible:
        name = next(iter(packed.flexible))
        raise SceneError(
            f'"{name}": sweep = "qr" needs rigid bodies, found a flexible one; {remedy}, '
            'or flexibility = "rigid"'
        )
    for number, body in enumerate(packed.system.distinct):
        if _min_eigenvalue(_mass_matrix(packed, body)) < _NEGATIVE:
            place = int(np.argmax(packed.system.distinct_indices == number))
            name = packed.scene.bodies.name(packed.topology.scene_indices(place)[0])
            raise SceneError(
                f'body "{name}": sweep = "qr" needs a positive semidefinite mass matrix, found a '
                "negative eigenvalue (a negative moment of inertia about some axis, or a mass "
                f"centre too far away for its digits); correct the body, or {remedy}"
            )
    packed.qr, packed.model.qr = True, 1


def _mass_matrix(packed: PackedScene, body: BodyNumbers) -> Array:
    """Mass matrix (6, 6) of a body about its input end."""
    ffi, upper = packed.ffi, np.zeros(21)
    call = ffi.cast(
        "int (*)(const double *, double *)", packed.elements[body.body].functions["inertia"]
    )
    call(list(body.body_p), ffi.from_buffer("double[]", upper))
    matrix = np.zeros((6, 6))
    matrix[_UPPER] = upper
    return np.asarray(matrix + np.triu(matrix, 1).T)


def _min_eigenvalue(matrix: Array) -> float:
    """Smallest eigenvalue of a matrix scaled to unit diagonal."""
    diagonal = np.diagonal(matrix)
    if diagonal.min() < 0:
        return float(diagonal.min())
    root = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    return float(np.linalg.eigvalsh(matrix / np.outer(root, root))[0])


def reject_qr_steps(packed: PackedScene) -> None:
    """Raise SceneError for the QR sweep with steps that are not computed from accelerations.

    Tangents of implicit methods and classical matrices would lose the digits that this sweep keeps.
    """
    if packed.qr:
        raise SceneError(
            'sweep = "qr" gives accelerations only, which implicit and classical methods do not '
            f'use; use {EXPLICIT_METHODS}, or sweep = "riccati"'
        )


# --- product of transfer matrices along a chain ---------------------------------------------------

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
