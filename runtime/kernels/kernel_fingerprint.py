"""Fingerprint of the kernels that a compiled scene uses."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

from mstmm.ir.scene_structure import Key

from .prebuilt_kernels import Element


@cache
def _manifest() -> bytes:
    return files("mstmm.generated").joinpath("manifest.json").read_bytes()


def kernels_hash(known: Mapping[Key, Element] | None) -> str:
    """SHA-256 of the hashes of all generated kernels, and of elements that are not prebuilt."""
    digest = hashlib.sha256(_manifest())
    for (kind, name), element in sorted((known or {}).items()):
        digest.update(f"{kind} {name} {element.hash}\n".encode())
    return digest.hexdigest()
