"""Mesh files of shapes, stored with a result."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.scene import Scene

#: Size limit of all stored files of a scene, bytes.
_MAX_BYTES = 50_000_000

Variable = tuple[tuple[str, ...], Any, dict[str, str], dict[str, Any]]


def file_contents(scene: Scene, came: Mapping[str, bytes]) -> dict[str, bytes]:
    """Contents of the mesh files of a scene's shapes by path.

    As stored with a result, else as they are now. Unreadable files are left out; all of them are if
    they are too large to store.
    """
    files = dict(came)
    names = {shape.file for shape in scene.shape if shape.file is not None}
    present = [path for name in names - set(files) if (path := Path(name)).is_file()]
    if sum(path.stat().st_size for path in present) > _MAX_BYTES:
        return files
    for path in present:
        try:
            files[str(path)] = path.read_bytes()
        except OSError:
            continue
    return files


def variables(scene: Scene, came: Mapping[str, bytes]) -> dict[str, Variable]:
    """Dataset variables of mesh files: bytes, and the path as an attribute."""
    rows: dict[str, Variable] = {}
    for k, (path, content) in enumerate(sorted(file_contents(scene, came).items())):
        attributes = {"long_name": "file of a mesh that shapes are drawn by", "path": path}
        values = np.frombuffer(content, dtype=np.uint8)
        rows[f"mesh_{k}"] = ((f"mesh_{k}_byte",), values, attributes, {"zlib": True})
    return rows


def saved_meshes(data: Any) -> Mapping[str, bytes]:
    """Contents of the mesh files of a saved result by their paths in its scene."""
    names = [name for name in data if str(name).startswith("mesh_") and "path" in data[name].attrs]
    return {str(data[n].attrs["path"]): data[n].values.astype(np.uint8).tobytes() for n in names}
