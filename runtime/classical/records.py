"""C records of a scene's parts for the classical discrete-time method, and its stepper."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError

from ..engine.engine import Engine
from ..kernels.records import Records
from .chains import refuse_product
from .forms import MOTION, Form
from .parts import Part
from .schemes import Scheme

#: Corrections at which iterations end, and position gaps at which a step fails, relative to the
#: size of the scene or in rad; loads that the product may leave at a free tip, relative to the
#: largest load.
TOLERANCE, GAP, ACCURACY = 1e-10, 1e-2, 1e-6


class Stepper:
    """C stepper of a scene's parts in one form, from initial motions (n, MOTION).

    `turning=False` omits the tangent operator of spatial rotations, to show its effect.
    """

    def __init__(
        self, engine: Engine, parts: Sequence[Part], form: Form, scheme: Scheme, start: Array,
        iterations: int, product: bool, turning: bool = True,
    ) -> None:  # fmt: skip
        ffi, lib = engine.ffi, engine.lib
        if product and not form.planar:
            refuse_product(engine.packed, parts)
        self.lib, self.ffi, self.count = lib, ffi, len(parts)
        self._bodies = Records(ffi, "mstmm_classical_body", self.count)
        for k, part in enumerate(parts):
            record = self._bodies.array[k]
            record.hinge = getattr(lib, f"MSTMM_CLASSICAL_{part.kind}")
            record.mass, record.modes = part.mass, form.shapes if part.bending else 0
            for name, numbers in form.record(parts, k).items():
                getattr(record, name)[0 : len(numbers)] = numbers.tolist()
        _tree(self._bodies, [part.parent for part in parts])
        self.motions = np.ascontiguousarray(start)
        self._work = np.zeros(max(1, lib.mstmm_classical_work_size(self.count)), dtype=np.uint8)
        self.run = run = ffi.new("mstmm_classical_run *")
        run.n_bodies, run.bodies = self.count, self._bodies.array
        run.product, run.iterations, run.turning = product, iterations, turning
        run.planar = form.planar
        run.gravity = form.gravity(np.array(engine.packed.system.gravity)).tolist()
        for name in ("alpha_m", "alpha_f", "beta", "gamma", "theta"):
            setattr(run.scheme, name, getattr(scheme, name))
        run.size = size_of(parts)
        run.tolerance, run.gap, run.accuracy = TOLERANCE, GAP, ACCURACY
        run.motions = ffi.from_buffer("mstmm_classical_motion[]", self.motions)
        run.work = ffi.from_buffer("char[]", self._work)

    def advance(self, count: int, step: float) -> Array:
        """Motions (n, parts, MOTION) after up to `count` steps of `step` s; fewer on failure."""
        samples = np.empty((count, self.count, MOTION))
        made = self.lib.mstmm_classical_advance(
            self.run, count, step, self.ffi.from_buffer("mstmm_classical_motion[]", samples)
        )
        return samples[:made]


def _tree(bodies: Records, parents: Sequence[int]) -> None:
    """Write the tree into the records: parent, first child and next sibling of each body."""
    child, following = [-1] * len(parents), [-1] * len(parents)
    last: dict[int, int] = {}
    for place, parent in enumerate(parents):
        if parent in last:
            following[last[parent]] = place
        elif parent >= 0:
            child[parent] = place
        if parent >= 0:
            last[parent] = place
    for name, numbers in (("parent", parents), ("child", child), ("next", following)):
        bodies.write(name, np.array(numbers, dtype=np.int64))


def size_of(parts: Sequence[Part]) -> float:
    """Size of a scene, m: largest distance of hinges on a body, or of mass centre and hinge."""
    places = [hypot(*part.hung.point) for part in parts]
    centres = [hypot(*part.first) / part.mass for part in parts if part.mass > 0]
    found = max([*places, *centres]) or 1.0
    if not np.isfinite(found):
        raise SceneError("the size of the scene is not finite")
    return found
