"""A run kept in a file, so that another process can continue it bit for bit."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure, SceneError

from ..integrate.c_loop import Samples
from ..integrate.settings import Settings
from ..kernels.kernel_fingerprint import kernels_hash
from ..platform_support.safe_files import read_arrays, replace_atomically, require_regular_file

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

State = Mapping[str, Any]

_FORMAT = "mstmm checkpoint 5"
_ROWS = ("t", "y", "memory", "event")

#: Name, kind of numbers and axes of what a file holds.
_STATE = (
    ("real", "f", 1), ("integer", "i", 1), ("engine", "U", 0), ("message", "U", 0),
    ("methods", "U", 0), ("seconds", "f", 0),
)  # fmt: skip
_SAMPLES = (("t", "f", 1), ("y", "f", 2), ("memory", "f", 2), ("event", "i", 1))


class Checkpoint:
    """One file: what was asked for (as hashes), where the run stands, every sample so far.

    Raises EnvironmentFailure at once if its folder cannot be written.
    """

    def __init__(
        self, path: Path, model: CompiledScene, settings: Settings, q: Array, u: Array
    ) -> None:
        self.path = path
        folder = path.absolute().parent
        if not folder.is_dir() or not os.access(folder, os.W_OK):
            raise EnvironmentFailure(f'checkpoint "{path}": its folder cannot be written to')
        self.asked = {
            "scene": _hash(model.scene.to_toml()),
            "settings": _hash(json.dumps(asdict(settings)) + q.tobytes().hex() + u.tobytes().hex()),
            "kernels": kernels_hash(model.known),
        }

    def exists(self) -> bool:
        """True if there is something to continue."""
        return self.path.exists()

    def save(self, state: State, samples: Samples) -> None:
        """Write everything; the old file stays until the new one is whole."""
        rows = {name: getattr(samples, name) for name in _ROWS}
        with replace_atomically(self.path) as temporary, temporary.open("wb") as file:
            words = {key: np.array(text) for key, text in self.asked.items()}
            arrays: dict[str, Any] = {"format": np.array(_FORMAT), **state, **rows, **words}
            np.savez(file, **arrays)

    def load(self) -> tuple[State, Samples]:
        """State and samples.

        SceneError if the file is no checkpoint, is damaged, or belongs to another run.
        """
        require_regular_file(self.path, "checkpoint")
        try:
            data = read_arrays(self.path)
        except (FileNotFoundError, ValueError) as error:
            raise SceneError(f'checkpoint "{self.path}" cannot be read: {error}') from None
        if str(data.get("format")) != _FORMAT:
            raise SceneError(f'checkpoint "{self.path}" is not one of this version of mstmm')
        for key, word in (
            ("scene", "the scene has"),
            ("settings", "the settings or the start have"),
            ("kernels", "the compiled kernels have"),
        ):
            if str(data.get(key)) != self.asked[key]:
                raise SceneError(
                    f'checkpoint "{self.path}" belongs to another run: {word} changed since; '
                    "run without resume to start again"
                )
        state = {name: self._taken(data, name, kind, ndim) for name, kind, ndim in _STATE}
        if not 0.0 <= state["seconds"] < np.inf:
            raise self.damaged("a time that no run can have taken")
        rows = [self._taken(data, name, kind, ndim) for name, kind, ndim in _SAMPLES]
        times = rows[0]
        if len({len(row) for row in rows}) > 1 or not np.all(times[1:] >= times[:-1]):
            raise self.damaged("samples that do not belong together")
        return state, Samples(*rows)

    def _taken(self, data: State, name: str, kind: str, ndim: int) -> Any:
        """One array as it was written; SceneError if it is missing or of another kind."""
        found = data.get(name)
        if found is None or found.dtype.kind != kind or found.ndim != ndim:
            what = "nothing" if found is None else f"{found.dtype} of shape {found.shape}"
            raise self.damaged(f"{what} as {name}")
        return found

    def damaged(self, found: str) -> SceneError:
        """The error for a file whose numbers nobody wrote this way."""
        return SceneError(
            f'checkpoint "{self.path}" is damaged: it holds {found}; '
            "run without resume to start again"
        )

    def remove(self) -> None:
        """The result is where it belongs: nothing to continue."""
        with suppress(OSError):  # a file that stays is refused or continued, never wrong
            self.path.unlink(missing_ok=True)


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
