"""How motion is carried through flexible bodies, for the judgement of the sweep's pivots.

With its modes condensed a body that its frame carries by delta answers with etadd = -G delta, so a
section moves by X delta + H etadd; where the frame follows the section that is held, the frame
itself by delta + H etadd.  The rounding of the body's own inertia counts in frame and modes alike.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array

if TYPE_CHECKING:
    from ...pack.packed import Packed


class ModalPivots:
    """Where gains and subspaces of the flexible bodies stand in the workspace (`layout.h`): of a
    body S_rf and the same re-based (6, n), the gain (n, 7), S_ff (n, n); of a section its subspace
    (6, n)."""

    def __init__(self, packed: Packed, lib: Any) -> None:
        self._rows, self._based = lib.MSTMM_MODES_S_RF_PER_MODE, lib.MSTMM_MODES_BASED_PER_MODE
        self._gain, self._inner = lib.MSTMM_MODES_GAIN_PER_MODE, lib.MSTMM_MODES_S_FF_PER_MODE
        self._subspace = lib.MSTMM_SECTION_H_PER_MODE
        self.frames: dict[int, tuple[int, int, int | None]] = {}
        modal, sections = packed.written.modal, packed.written.sections
        for i, place in modal.items():
            body = packed.system.body(i)
            assert body.modal is not None
            self.frames[i] = (body.modal.n, place, sections.get(i))
        self.sections = {i: place for i, place in sections.items() if i not in modal}

    def through(
        self, numbers: Array, S: Array, carried: Array, parents: NDArray[np.int64], E: Array
    ) -> None:
        """Change in place: `carried` (m, 6, 6), the motion of each body from that of its parent, to
        what it is with the modes giving way, and the rounding `E` (m, 6, 6) of each flexible body.

        `S` (m, 6, 6) are the inertias with the modes condensed.
        """
        answers = {i: self._answer(numbers, i) for i in self.frames}
        for i, parent in enumerate(parents.tolist()):
            if parent in answers:
                gain, moved = answers[parent]
                own = carried[i] @ moved
                if i in self.sections:
                    n = len(gain)
                    first = self.sections[i] + self._subspace * n
                    own = own - numbers[first : first + 6 * n].reshape(6, n) @ gain
                carried[i] = own
        for i, (n, place, inward) in self.frames.items():
            gain, moved = answers[i]
            first = place + n * (self._rows if inward is None else self._based)
            rows = numbers[first : first + 6 * n].reshape(6, n)
            whole = np.abs(np.diag(S[i] + rows @ gain))
            inner = place + self._inner * n
            modal = np.abs(np.diag(numbers[inner : inner + n * n].reshape(n, n)))
            E[i] = moved.T @ (whole[:, None] * moved) + gain.T @ (modal[:, None] * gain)

    def _answer(self, numbers: Array, i: int) -> tuple[Array, Array]:
        """G (n, 6), and the motion (6, 6) of the frame itself."""
        n, place, inward = self.frames[i]
        first = place + self._gain * n
        gain = numbers[first : first + 7 * n].reshape(n, 7)[:, :6]
        if inward is None:
            return gain, np.eye(6)
        first = inward + self._subspace * n
        subspace = numbers[first : first + 6 * n].reshape(6, n)
        return gain, np.eye(6) - subspace @ gain
