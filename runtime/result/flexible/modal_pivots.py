"""Transfer of motion through flexible bodies, for the check of the pivots of the sweep.

With condensed modes, a body whose frame moves by delta responds with etadd = -G delta, so a section
moves by X delta + H etadd; where the frame follows the inboard section, the frame itself moves by
delta + H etadd. The rounding of the body's own inertia counts in both frame and modes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

if TYPE_CHECKING:
    from ...packing.packed_scene import PackedScene


class ModalPivots:
    """Offsets of gains and subspaces of the flexible bodies in the workspace (`layout.h`).

    Of a body: S_rf and the same re-based (6, n), the gain (n, 7), S_ff (n, n); of a section: its
    subspace (6, n).
    """

    def __init__(self, packed: PackedScene, lib: Any) -> None:
        self._rows, self._rebased = lib.MSTMM_MODES_S_RF_PER_MODE, lib.MSTMM_MODES_S_RF_I_PER_MODE
        self._gain, self._inner = lib.MSTMM_MODES_GAIN_PER_MODE, lib.MSTMM_MODES_S_FF_PER_MODE
        self._subspace = lib.MSTMM_SECTION_H_PER_MODE
        self.frames: dict[int, tuple[int, int, int | None]] = {}
        modal, sections = packed.written.modal, packed.written.sections
        for i, index in modal.items():
            body = packed.system.body(i)
            assert body.modal is not None
            self.frames[i] = (body.modal.n, index, sections.get(i))
        self.sections = {i: index for i, index in sections.items() if i not in modal}

    def add_modal_response(
        self, numbers: Array, S: Array, carried: Array, parents: NDArray[np.int64], E: Array
    ) -> None:
        """Add the modal response to the transferred motions and the rounding, in place.

        `carried` (m, 6, 6) is the motion of each body from that of its parent, `E` (m, 6, 6) the
        rounding of each flexible body, and `S` (m, 6, 6) are the inertias with condensed modes.
        """
        gains = {i: self._gain_and_motion(numbers, i) for i in self.frames}
        for i, parent in enumerate(parents.tolist()):
            if parent in gains:
                gain, frame_motion = gains[parent]
                motion = carried[i] @ frame_motion
                if i in self.sections:
                    n = len(gain)
                    first = self.sections[i] + self._subspace * n
                    motion = motion - numbers[first : first + 6 * n].reshape(6, n) @ gain
                carried[i] = motion
        for i, (n, offset, section_offset) in self.frames.items():
            gain, frame_motion = gains[i]
            first = offset + n * (self._rows if section_offset is None else self._rebased)
            rows = numbers[first : first + 6 * n].reshape(6, n)
            frame_rounding = np.abs(np.diag(S[i] + rows @ gain))
            first_ff = offset + self._inner * n
            modal_rounding = np.abs(np.diag(numbers[first_ff : first_ff + n * n].reshape(n, n)))
            E[i] = frame_motion.T @ (frame_rounding[:, None] * frame_motion) + gain.T @ (
                modal_rounding[:, None] * gain
            )

    def _gain_and_motion(self, numbers: Array, i: int) -> tuple[Array, Array]:
        """Gain G (n, 6), and the motion (6, 6) of the frame itself."""
        n, offset, section_offset = self.frames[i]
        first = offset + self._gain * n
        gain = numbers[first : first + 7 * n].reshape(n, 7)[:, :6]
        if section_offset is None:
            return gain, np.eye(6)
        first = section_offset + self._subspace * n
        subspace = numbers[first : first + 6 * n].reshape(6, n)
        return gain, np.eye(6) - subspace @ gain
