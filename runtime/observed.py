"""What the states of a run show, computed in batches when first asked for, and kept.

One batch of the engine gives everything at once for a run of usual size; where that would not fit
into memory, each body and each kind of quantity is a batch of its own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.errors import SceneError
from mstmm.scene import split
from mstmm.scene_errors import near

from .engine import PARTS, Probe

if TYPE_CHECKING:
    from .model import Model
    from .simulate import Trajectory

Array = NDArray[np.float64]

#: Numbers of one batch, about 130 MB.
_BATCH = 2**24


class Observed:
    """Arrays over the samples of a trajectory.  Rows that cannot be evaluated are nan.

    `failures` holds one sentence for each such row, as far as they have been met.
    """

    def __init__(self, model: Model, run: Trajectory) -> None:
        self.engine, self.run = model._engine, run
        self.failures: tuple[str, ...] = ()
        self.references = references(model)
        self.known = frozenset(self.references)
        self._points: dict[str, Array] = {}
        self._parts: dict[str, Array] = {}

    def points(self, reference: str) -> Array:
        """(n, 24): motion of "body" or "body.end", see `Observation`."""
        if reference not in self._points:
            if reference not in self.known and split(reference)[0] != "ground":
                raise SceneError(self._unknown(reference))
            self._observe("points", reference)
        return self._points[reference]

    def part(self, name: str) -> Array:
        """loads, efforts, udot or sums, see `Observation`."""
        if name not in self._parts:
            self._observe(name, None)
        return self._parts[name]

    def _unknown(self, reference: str) -> str:
        hint = near(reference, self.references)
        return f'"{reference}": there is no such body or end in the scene{hint}'

    def _observe(self, part: str, reference: str | None) -> None:
        run = self.run
        bodies = self.engine.packed.topology.count
        wanted = list(self.references)
        size = len(run.t) * (24 * len(wanted) + 6 * bodies + 2 * self.engine.nu + 10)
        parts = PARTS if size <= _BATCH else (part,)
        if size > _BATCH or reference not in self.known:
            wanted = [] if reference is None else [reference]
        probes = [Probe(*self.engine.packed.end(r)) for r in wanted]
        seen = self.engine.observe(run.t, run.q, run.u, run.memory, probes, parts)
        for array in (seen.points, *(getattr(seen, name) for name in PARTS)):
            array.flags.writeable = False
        self.failures = self.failures or seen.failures
        for i, name in enumerate(wanted):
            self._points[name] = seen.points[:, i]
        self._parts |= {name: getattr(seen, name) for name in parts if name != "points"}


def references(model: Model) -> tuple[str, ...]:
    """Every body and every end of the scene: "rod1", "rod1.tip"."""
    return tuple(
        name
        for body in model.scene.body
        for name in (body.name, *(f"{body.name}.{end}" for end in body.ends))
    )


def quaternions(matrices: Array) -> Array:
    """Unit quaternions (n, 4), w, x, y, z, of rotation matrices (n, 9), row by row.

    The largest of the four components is found first, so that no division is by a small number
    (Shepperd, J. Guidance and Control 1 (1978) 223-224).  The sign is continuous over the rows and
    w >= 0 in the first one.
    """
    r = matrices.reshape(-1, 3, 3)
    x, y, z = r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]
    squares = np.stack([1 + x + y + z, 1 + x - y - z, 1 - x + y - z, 1 - x - y + z], axis=1)
    pick = np.argmax(np.nan_to_num(squares), axis=1)
    a, b, c = r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]
    d, e, f = r[:, 0, 1] + r[:, 1, 0], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 2] + r[:, 2, 1]
    w2, x2, y2, z2 = squares.T
    rows = np.stack([
        np.stack([w2, a, b, c], 1), np.stack([a, x2, d, e], 1),
        np.stack([b, d, y2, f], 1), np.stack([c, e, f, z2], 1),
    ], 1)  # fmt: skip
    q = rows[np.arange(len(r)), pick]
    q /= np.sqrt(np.sum(q * q, axis=1, keepdims=True))
    return np.asarray(q * continuous_signs(q)[:, None])


def continuous_signs(q: Array) -> Array:
    """Signs (n,) that make neighbouring quaternions point the same way; +w first."""
    if not len(q):
        return np.ones(0)
    steps = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0)
    first = -1.0 if q[0, 0] < 0 else 1.0
    return np.asarray(first * np.concatenate([[1.0], np.cumprod(steps)]))
