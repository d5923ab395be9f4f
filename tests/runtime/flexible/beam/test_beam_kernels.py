"""Beams of many shapes: no kernel is evaluated for pairs, no array holds pairs at all points."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.flexible.beam import beam_kernels
from mstmm.runtime.flexible.beam.beam_kernels import kernel_terms, known_factor
from mstmm.runtime.flexible.modal_body import ModalBody

Array = NDArray[np.float64]

DOWN = [0, -9.81, 0]
FIXED = {"name": "h", "type": "fixed", "inboard": "ground", "outboard": "b"}
PLAIN = {"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": [1.0, 2.0],
         "torsional_stiffness": 0.7, "axial_stiffness": 1e3,
         "polar_inertia_per_length": 0.01}  # fmt: skip
GROUPS = {
    "moments": (
        ("x",), ("inertia", "stiffness"),
        ("axis_k", "turn_k", "strain_k"), ("axis_l", "turn_l", "strain_l"),
    ),
    "second_moments": (("x",), ("inertia",), ("turn_k",), ("turn_l",), ("g", "h_turn")),
    "turning": (("theta_k", "kappa_k"), ("theta_l", "kappa_l")),
    "drawing": (("theta_k", "eps_k"), ("theta_l", "eps_l"), ("h",)),
}  # fmt: skip


def model(**keys: Any) -> mstmm.Model:
    return mstmm.compile(
        mstmm.Scene(gravity=DOWN, beam=[PLAIN | keys], hinge=[FIXED]), engine="looped"
    )


def body(**keys: Any) -> ModalBody:
    return model(**keys).flexible_bodies["b"]


def peak(work: Callable[[], object]) -> int:
    """Bytes that the work takes at most."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("kernel", GROUPS)
def test_a_kernel_of_pairs_is_the_sum_of_its_terms(kernel: str, rng: np.random.Generator) -> None:
    groups = GROUPS[kernel]
    given = {
        k: rng.normal(size=(beam_kernels.input_size(kernel, k), 5))
        for group in groups
        for k in group
    }
    whole = [np.concatenate([given[name] for name in group]) for group in groups]
    for name, values in beam_kernels.evaluate(kernel, given).items():
        for index, of_entry in kernel_terms(kernel, *groups)[name].items():
            total = sum((known_factor(term, *whole) for term in of_entry), np.zeros(5))
            np.testing.assert_allclose(values[index], total, rtol=1e-13, atol=1e-13)


def test_no_kernel_is_evaluated_for_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Points along the beam go with the shapes, so that evaluations for each shape go with their
    square; for each pair they would go with the cube."""
    evaluated: list[int] = []
    evaluate = beam_kernels.evaluate

    def evaluate_and_record(name: str, inputs: Mapping[str, Array]) -> dict[str, Array]:
        evaluated.append(max(array.size for array in inputs.values()))
        return evaluate(name, inputs)

    monkeypatch.setattr(beam_kernels, "evaluate", evaluate_and_record)
    body(modes={"y": 2})  # the terms of the kernels
    totals = []
    for count in (15, 30, 60):
        evaluated.clear()
        body(modes={"y": count}, stiffening=True)
        totals.append(sum(evaluated))
    assert all(1 < more / fewer < 5 for fewer, more in pairwise(totals))


@pytest.mark.parametrize("frame", ["tangent", "chord", "mean"])
@pytest.mark.parametrize("count", [3, 9])
def test_what_motions_draw_is_what_all_pairs_draw(
    frame: str, count: int, rng: np.random.Generator
) -> None:
    modes = {"y": count, "z": count, "twist": count, "axial": 2}
    shapes = body(modes=modes, frame=frame).shapes
    assert shapes is not None
    x = np.array([0.7, 0.0, 1.0, 0.31])
    a, b = rng.normal(size=(2, 6, shapes.n))
    for carried in (False, True):
        pairs = np.einsum("mrkl,tk,tl->tmr", shapes.second_order.field_at(x, carried), a, b)
        drawn = shapes.second_order.evaluate(x, a, b, carried)
        np.testing.assert_allclose(drawn, pairs, atol=1e-13 * np.abs(pairs).max())


def test_sums_over_sections_are_the_sums_of_all_pairs(rng: np.random.Generator) -> None:
    shapes = body(modes={"y": 3, "z": 3, "twist": 2}, frame="mean").shapes
    assert shapes is not None
    x, weights = rng.uniform(0.0, 1.0, 7), rng.normal(size=(2, 7))
    whole = np.tensordot(weights, shapes.second_order.field_at(x), axes=1)
    sums = shapes.second_order.sums(x, weights)
    np.testing.assert_allclose(sums, whole, atol=1e-13 * np.abs(whole).max())


def test_the_most_shapes_in_all_directions_take_little_memory() -> None:
    modes = dict.fromkeys(("y", "z", "twist", "axial"), 60)
    numbers = (4 * 60) ** 2
    assert peak(lambda: body(modes=modes)) < 120 * 8 * numbers  # of which the body holds 32


def test_definiteness_is_judged_in_portions() -> None:
    piece = {"mass_per_length": 1.0, "bending_stiffness": 1.0, "length": 0.5, "modes": {"y": 60}}
    scene = mstmm.Scene(
        gravity=DOWN,
        beam=[piece | {"name": name} for name in ("b", "c")],
        hinge=[FIXED, {"name": "w", "type": "fixed", "inboard": "b.tip", "outboard": "c"}],
    )
    # Some hundred and seventy deflections, each with a matrix of its own.
    assert peak(lambda: mstmm.compile(scene, engine="looped")) < 60e6


def test_more_points_of_mass_than_memory_are_refused_by_name() -> None:
    keys = {"modes": dict.fromkeys(("y", "z", "twist"), 60), "quadrature": True,
            "basis": "clamped-free", "frame": "tangent", "ends": {"mid": 0.5}}  # fmt: skip
    hinge = FIXED | {"outboard": "b.mid"}
    scene = mstmm.Scene(gravity=DOWN, beam=[PLAIN | keys], hinge=[hinge])
    with pytest.raises(mstmm.SceneError, match=r'beam "b": .* mass points .* give fewer shapes'):
        mstmm.compile(scene, engine="looped")


def test_the_certificate_takes_pairs_of_shapes_in_portions() -> None:
    gone = model(modes={"y": 16, "z": 16}, stiffening=False).simulate(1e-5, method="rk4", step=1e-6)
    assert peak(lambda: gone.certificate.flexible_bodies) < 150e6
