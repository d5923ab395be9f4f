"""Beams of many shapes: pairs of them at many sections do not fill the memory."""

from __future__ import annotations

import tracemalloc

import numpy as np

import mstmm
from mstmm.runtime.flexible.beam import kernels


def test_the_certificate_takes_pairs_of_shapes_in_portions() -> None:
    beam = {"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
            "modes": {"y": 16, "z": 16}, "stiffening": False}  # fmt: skip
    hinge = {"name": "h", "type": "fixed", "inboard": "ground", "outboard": "b"}
    scene = mstmm.Scene(gravity=[0, -9.81, 0], beam=[beam], hinge=[hinge])
    result = mstmm.compile(scene, engine="looped").simulate(1e-5, method="rk4", step=1e-6)
    tracemalloc.start()
    try:
        assert result.certificate.flexible[0].slope > 0
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 150e6


def test_points_in_batches_are_the_points_at_once(rng: np.random.Generator) -> None:
    inputs = {"values": rng.normal(size=(4, 30, 60000)), "slopes": rng.normal(size=(2, 30, 60000))}
    whole = kernels.evaluate("section", inputs)
    few = kernels.evaluate("section", {key: array[..., -9:] for key, array in inputs.items()})
    assert whole["theta"].shape == (3, 30, 60000)
    assert all(np.array_equal(few[key], whole[key][..., -9:]) for key in few)
