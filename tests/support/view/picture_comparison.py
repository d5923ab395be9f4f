"""Pictures compared in coarse blocks, which neither fonts nor other browsers change much."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image

#: How far blocks of another browser may be from known ones, of 255: on the average, one of them.
MEAN, WORST = 3.0, 40.0


def blocks(picture: bytes, box: tuple[int, int, int, int], size: tuple[int, int]) -> Image.Image:
    """Mean colours of a part of a PNG (left, top, right, bottom), so many across and down."""
    seen = Image.open(io.BytesIO(picture)).convert("RGB").crop(box)
    return seen.resize(size, Image.Resampling.BOX)


def matches_picture(seen: Image.Image, reference: str) -> bool:
    """Whether the picture looks like a reference in this folder, which a person has judged."""
    known = Image.open(Path(__file__).with_name(reference)).convert("RGB")
    off = np.abs(np.asarray(seen, dtype=float) - np.asarray(known, dtype=float))
    return bool(off.mean() < MEAN and off.max() < WORST)
