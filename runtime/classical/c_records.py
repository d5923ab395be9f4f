"""C records of a scene's parts for the classical discrete-time method, and its stepper."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import hypot

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ..engine.looped_engine import LoopedEngine
from ..integrate.steppers.alpha_family import Scheme
from ..kernels.c_records import CRecords
from ..packing.packed_scene import PackedScene
from .body_parts import Part
from .planar_and_spatial import MOTION, Form
from .supported_elements import BALL, ELASTIC_BALL, ELASTIC_PIN, PIN

#: Corrections at which iterations end, and position gaps at which a step fails, relative to the
#: size of the scene or in rad; loads that the product may leave at a free tip, relative to the
#: largest load.
_MAX_CORRECTION, _MAX_POSITION_GAP, _MAX_TIP_LOAD = 1e-10, 1e-2, 1e-6


class Stepper:
    """C stepper of a scene's parts in one form, from initial motions (n, MOTION).

    `turning=False` omits the tangent operator of spatial rotations, to show its effect.
    """

    def __init__(
        self, engine: LoopedEngine, parts: Sequence[Part], form: Form, scheme: Scheme, start: Array,
        iterations: int, product: bool, turning: bool = True,
    ) -> None:  # fmt: skip
        ffi, lib = engine.ffi, engine.lib
        if product and not form.planar:
            _check_product_chains(engine.packed, parts)
        self.lib, self.ffi, self.count = lib, ffi, len(parts)
        self._bodies = CRecords(ffi, "mstmm_classical_body", self.count)
        for k, part in enumerate(parts):
            record = self._bodies.array[k]
            record.hinge = getattr(lib, f"MSTMM_CLASSICAL_{part.kind}")
            record.mass, record.modes = part.mass, form.shapes if part.bending else 0
            for name, numbers in form.record(parts, k).items():
                getattr(record, name)[0 : len(numbers)] = numbers.tolist()
        _write_tree(self._bodies, [part.parent for part in parts])
        self.motions = np.ascontiguousarray(start)
        self._work = np.zeros(max(1, lib.mstmm_classical_work_size(self.count)), dtype=np.uint8)
        self.run = run = ffi.new("mstmm_classical_run *")
        run.n_bodies, run.bodies = self.count, self._bodies.array
        run.product, run.iterations, run.turning = product, iterations, turning
        run.planar = form.planar
        run.gravity = form.gravity(np.array(engine.packed.system.gravity)).tolist()
        for name in ("alpha_m", "alpha_f", "beta", "gamma", "theta"):
            setattr(run.scheme, name, getattr(scheme, name))
        run.size = scene_size(parts)
        run.tolerance, run.gap, run.accuracy = _MAX_CORRECTION, _MAX_POSITION_GAP, _MAX_TIP_LOAD
        run.motions = ffi.from_buffer("mstmm_classical_motion[]", self.motions)
        run.work = ffi.from_buffer("char[]", self._work)

    def advance(self, count: int, step: float) -> Array:
        """Motions (n, parts, MOTION) after up to `count` steps of `step` s; fewer on failure."""
        samples = np.empty((count, self.count, MOTION))
        step_count = self.lib.mstmm_classical_advance(
            self.run, count, step, self.ffi.from_buffer("mstmm_classical_motion[]", samples)
        )
        return samples[:step_count]


def _write_tree(bodies: CRecords, parents: Sequence[int]) -> None:
    """Write the tree into the records: parent, first child and next sibling of each body."""
    child, next_sibling = [-1] * len(parents), [-1] * len(parents)
    last_child: dict[int, int] = {}
    for place, parent in enumerate(parents):
        if parent in last_child:
            next_sibling[last_child[parent]] = place
        elif parent >= 0:
            child[parent] = place
        if parent >= 0:
            last_child[parent] = place
    for name, column in (("parent", parents), ("child", child), ("next", next_sibling)):
        bodies.write(name, np.array(column, dtype=np.int64))


def scene_size(parts: Sequence[Part]) -> float:
    """Size of a scene, m: largest distance of hinges on a body, or of mass centre and hinge."""
    hinge_distances = [hypot(*part.attachment.point) for part in parts]
    centre_distances = [hypot(*part.first) / part.mass for part in parts if part.mass > 0]
    size = max([*hinge_distances, *centre_distances]) or 1.0
    if not np.isfinite(size):
        raise SceneError("the size of the scene is not finite")
    return size


# --- chains of the plain product ------------------------------------------------------------------

#: Kind of a hinge -> type of its free rotation.
_ROTATION_TYPES = {PIN: "pin", ELASTIC_PIN: "pin", BALL: "ball", ELASTIC_BALL: "ball"}


def _check_product_chains(packed: PackedScene, parts: Sequence[Part]) -> None:
    """Raise SceneError for spatial chains whose free rotations the plain product cannot eliminate.

    The free rotation of a hinge is eliminated by the condition of the next hinge outboard, so both
    must be of the same type.  In the plane they always are.
    """
    for place, previous in _successive_free_rotations(parts):
        needed_type = _ROTATION_TYPES[parts[previous].kind]
        if _ROTATION_TYPES[parts[place].kind] != needed_type:
            link = packed.topology.links[parts[place].hinge]
            raise SceneError(
                f'hinge "{packed.scene.hinges.name(link.hinge)}": outboard of a hinge that rotates '
                f"as a {needed_type} the plain product needs another of that kind; use method "
                "dttmm-classical"
            )


def _successive_free_rotations(parts: Sequence[Part]) -> Iterator[tuple[int, int]]:
    """Pairs (place, place of the previous hinge with free rotation) along first children."""
    previous_in_branch: dict[int, int] = {}
    parents_with_child: set[int] = set()
    for place, part in enumerate(parts):
        parent = part.parent
        is_first_child = parent >= 0 and parent not in parents_with_child
        parents_with_child.add(parent)
        previous = previous_in_branch.get(parent, -1) if is_first_child else -1
        if part.kind in _ROTATION_TYPES:
            if previous >= 0:
                yield place, previous
            previous = place
        previous_in_branch[place] = previous
