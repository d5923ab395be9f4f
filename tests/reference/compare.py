"""How far two results are apart, and scenes drawn with a state of their own."""

from __future__ import annotations

from typing import Any

import numpy as np

from .jets import Array
from .random_scenes import random_scene, random_state

Drawn = tuple[dict[str, Any], Array, Array]


def worst(a: Any, b: Any, floor: float = 1e-300) -> float:
    """Largest difference over the largest entry of b, or over `floor` where b is smaller."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    return float(np.abs(a - b).max() / max(np.abs(b).max(), floor)) if b.size else 0.0


def seeded_scene(seed: int, **options: Any) -> Drawn:
    """Scene, q and u of a seed, which is printed for a failing test."""
    print(f"random_scenes seed = {seed}")
    scene = random_scene(seed, **options)
    return scene, *random_state(scene, seed + 1)


def fresh(rng: np.random.Generator, **options: Any) -> Drawn:
    """Scene, q and u of a seed drawn from the run's own generator."""
    return seeded_scene(int(rng.integers(2**32)), **options)
