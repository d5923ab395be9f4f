"""Checkpoint files, from which another process continues a run bit for bit."""

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
from ..kernels.prebuilt_kernels import kernels_hash
from ..platform_support.safe_files import read_arrays, replace_atomically, require_regular_file

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

State = Mapping[str, Any]

_FORMAT = "mstmm checkpoint 5"
_ROWS = ("t", "y", "memory", "event")

#: Name, NumPy dtype kind and number of axes of each array in a file.
_STATE = (
    ("real", "f", 1), ("integer", "i", 1), ("engine", "U", 0), ("message", "U", 0),
    ("methods", "U", 0), ("seconds", "f", 0),
)  # fmt: skip
_SAMPLES = (("t", "f", 1), ("y", "f", 2), ("memory", "f", 2), ("event", "i", 1))


class Checkpoint:
    """Checkpoint file: hashes of the request, integrator state, all samples so far.

    Raises EnvironmentFailure at construction if the folder is not writable.
    """

    def __init__(
        self, path: Path, model: CompiledScene, settings: Settings, q: Array, u: Array
    ) -> None:
        self.path = path
        folder = path.absolute().parent
        if not folder.is_dir() or not os.access(folder, os.W_OK):
            raise EnvironmentFailure(
                f'checkpoint "{path}": its folder does not exist or is not writable'
            )
        self.run_hashes = {
            "scene": _hash(model.scene.to_toml()),
            "settings": _hash(json.dumps(asdict(settings)) + q.tobytes().hex() + u.tobytes().hex()),
            "kernels": kernels_hash(model.known),
        }

    def exists(self) -> bool:
        """True if the checkpoint file exists."""
        return self.path.exists()

    def save(self, state: State, samples: Samples) -> None:
        """Write state and samples; the old file is replaced only once the new one is complete."""
        rows = {name: getattr(samples, name) for name in _ROWS}
        with replace_atomically(self.path) as temporary, temporary.open("wb") as file:
            hashes = {key: np.array(text) for key, text in self.run_hashes.items()}
            arrays: dict[str, Any] = {"format": np.array(_FORMAT), **state, **rows, **hashes}
            np.savez(file, **arrays)

    def load(self) -> tuple[State, Samples]:
        """Read state and samples.

        Raises SceneError if the file is no checkpoint, is damaged, or belongs to another run.
        """
        require_regular_file(self.path, "checkpoint")
        try:
            data = read_arrays(self.path)
        except (FileNotFoundError, ValueError) as error:
            raise SceneError(f'checkpoint "{self.path}" cannot be read: {error}') from None
        if str(data.get("format")) != _FORMAT:
            raise SceneError(
                f'checkpoint "{self.path}" was not written by this version of mstmm; '
                "run without resume to start again"
            )
        for key, changed in (
            ("scene", "the scene has"),
            ("settings", "the settings or the initial state have"),
            ("kernels", "the compiled kernels have"),
        ):
            if str(data.get(key)) != self.run_hashes[key]:
                raise SceneError(
                    f'checkpoint "{self.path}" belongs to another run: {changed} changed since; '
                    "run without resume to start again"
                )
        state = {name: self._checked_array(data, name, kind, ndim) for name, kind, ndim in _STATE}
        if not 0.0 <= state["seconds"] < np.inf:
            raise self.damage_error("an impossible elapsed time")
        rows = [self._checked_array(data, name, kind, ndim) for name, kind, ndim in _SAMPLES]
        times = rows[0]
        if len({len(row) for row in rows}) > 1 or not np.all(times[1:] >= times[:-1]):
            raise self.damage_error("inconsistent samples")
        return state, Samples(*rows)

    def _checked_array(self, data: State, name: str, kind: str, ndim: int) -> Any:
        """Array `name` of the file; SceneError if it is missing or of another kind or rank."""
        array = data.get(name)
        if array is None or array.dtype.kind != kind or array.ndim != ndim:
            found = "nothing" if array is None else f"{array.dtype} of shape {array.shape}"
            raise self.damage_error(f"{found} as {name}")
        return array

    def damage_error(self, found: str) -> SceneError:
        """Error for a file whose content no run can have written."""
        return SceneError(
            f'checkpoint "{self.path}" is damaged: it holds {found}; '
            "run without resume to start again"
        )

    def remove(self) -> None:
        """Delete the file once the result is complete."""
        # A file that cannot be deleted does no harm: a later run rejects or continues it.
        with suppress(OSError):
            self.path.unlink(missing_ok=True)


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
