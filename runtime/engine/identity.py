"""Which kernels a compiled scene runs on, in one number."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.resources import files

from .compiled import Compiled


@cache
def _manifest() -> bytes:
    return files("mstmm.generated").joinpath("manifest.json").read_bytes()


def kernels_hash(model: Compiled) -> str:
    """SHA-256 of the hashes of all generated kernels, and of the elements that are not prebuilt."""
    found = hashlib.sha256(_manifest())
    for (kind, name), element in sorted((model.known or {}).items()):
        found.update(f"{kind} {name} {element.hash}\n".encode())
    return found.hexdigest()
