"""Mesh files of shapes, stored with a result."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.scene import Scene

#: Size limit of all stored files of a scene, bytes.
_MOST = 50_000_000

Variable = tuple[tuple[str, ...], Any, dict[str, str], dict[str, Any]]


def contents(scene: Scene, came: Mapping[str, bytes]) -> dict[str, bytes]:
    """What the files of a scene's shapes hold, by their paths: as they came with a result, else as
    they are now.  Files that cannot be read are left out; all are where they are too large to keep.
    """
    found = dict(came)
    wanted = {shape.file for shape in scene.shape if shape.file is not None}
    present = [path for name in wanted - set(found) if (path := Path(name)).is_file()]
    if sum(path.stat().st_size for path in present) > _MOST:
        return found
    for path in present:
        try:
            found[str(path)] = path.read_bytes()
        except OSError:
            continue
    return found


def variables(scene: Scene, came: Mapping[str, bytes]) -> dict[str, Variable]:
    """Dataset variables of mesh files: bytes, and the path as an attribute."""
    found: dict[str, Variable] = {}
    for k, (path, content) in enumerate(sorted(contents(scene, came).items())):
        about = {"long_name": "file of a mesh that shapes are drawn by", "path": path}
        values = np.frombuffer(content, dtype=np.uint8)
        found[f"mesh_{k}"] = ((f"mesh_{k}_byte",), values, about, {"zlib": True})
    return found


def kept(data: Any) -> Mapping[str, bytes]:
    """Contents of the mesh files of a saved result by their paths in its scene."""
    names = [name for name in data if str(name).startswith("mesh_") and "path" in data[name].attrs]
    return {str(data[n].attrs["path"]): data[n].values.astype(np.uint8).tobytes() for n in names}
