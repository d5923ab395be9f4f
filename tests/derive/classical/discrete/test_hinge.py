"""What the book says in words about its matrices (ch. 8), of the generated ones.

How the matrices of one pairing follow from those of another by leaving out rows or columns, and the
conditions under which they do.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mstmm.derive.classical.catalogue import CLASSICAL
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.ir import KernelIR
from mstmm.ir.interpreter import evaluate_floats

Array = NDArray[np.float64]
Numbers = dict[str, Array]

FAMILIES = (
    "hinge_fixed_planar", "hinge_smooth_planar", "hinge_spring_planar", "hinge_fixed_spatial",
    "hinge_ball_spatial", "hinge_elastic_spatial",
)  # fmt: skip
SMOOTH = ("hinge_smooth_planar", "hinge_ball_spatial")


@cache
def kernel(name: str) -> KernelIR:
    return lower(CLASSICAL[name](), "transfer")


def numbers(name: str, rng: np.random.Generator) -> Numbers:
    """Random inputs; U with its closing row."""
    found = {p.name: rng.uniform(-1, 1, [int(e) for e in p.shape]) for p in kernel(name).inputs}
    if "U" in found:
        found["U"][-1] = np.eye(len(found["U"]))[-1]
    return found


def matrix(name: str, values: Numbers) -> Array:
    ir = kernel(name)
    given: dict[str, Any] = {p.name: values[p.name].ravel().tolist() for p in ir.inputs}
    rows, columns = (int(extent) for extent in ir.outputs[0].shape)
    return np.array(evaluate_floats(ir, given)["U_h"]).reshape(rows, columns)


def modal(name: str) -> slice:
    """Places of the modal coordinates in a state with them."""
    return slice(6, 9) if "planar" in name else slice(12, 14)


def without(matrix_: Array, places: slice, axis: int) -> Array:
    return np.delete(matrix_, np.arange(places.start, places.stop), axis)


@pytest.mark.parametrize("family", FAMILIES)
def test_rigid_inboard_leaves_out_the_modal_columns(family: str, rng: np.random.Generator) -> None:
    """(8.101) of (8.98), (8.125) of (8.121), (8.137) of (8.135), (8.193) of (8.199), ..."""
    values = numbers(f"{family}_beam_beam", rng)
    for name in ("eta_pI", "S_I", "Theta_I"):
        if name in values:
            values[name] = 0 * values[name]
    both = matrix(f"{family}_beam_beam", values)
    rigid = matrix(f"{family}_rigid_beam", values)
    assert np.allclose(without(both, modal(family), 1), rigid, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("family", SMOOTH)
@pytest.mark.parametrize("outboard", ["beam", "rigid"])
def test_smooth_hinges_do_not_feel_the_inboard_shapes(
    family: str, outboard: str, rng: np.random.Generator
) -> None:
    """(8.105) is (7.219) with columns of zeros behind the sixth; the same holds for (8.98)."""
    name = f"{family}_beam_{outboard}"
    found = matrix(name, numbers(name, rng))
    assert np.all(found[:, modal(family)] == 0)


@pytest.mark.parametrize("family", ["hinge_fixed_planar", "hinge_fixed_spatial"])
@pytest.mark.parametrize("clamped", [True, False])
def test_rigid_outboard_leaves_out_the_modal_rows_of_clamped_shapes_alone(
    family: str, clamped: bool, rng: np.random.Generator
) -> None:
    """(8.139) of (8.135), (8.201) of (8.199): only if the outboard shapes have no slope there."""
    values = numbers(f"{family}_beam_beam", rng)
    slopes = "Theta_O" if "planar" in family else "S_O"
    values[slopes] *= 0.0 if clamped else 1.0
    both = without(matrix(f"{family}_beam_beam", values), modal(family), 0)
    rigid = matrix(f"{family}_beam_rigid", values)
    assert np.allclose(both, rigid, rtol=1e-12, atol=1e-12) == clamped


def test_spring_keeps_force_and_moment_but_not_the_place(rng: np.random.Generator) -> None:
    """Without length and load the spring hinge transmits q and m; x and y differ by q / k.

    Section 8.6 says once that "x, y and m" are equal, where (8.106) and (8.111) need q and m.
    """
    values = numbers("hinge_spring_planar_rigid_rigid", rng)
    values |= {name: 0 * values[name] for name in ("d_s", "q_s", "c_t")}
    values["k_t"] = np.diag([20.0, 30.0])
    found = matrix("hinge_spring_planar_rigid_rigid", values)
    assert np.allclose(found[3:6], np.eye(7)[3:6], atol=1e-12)
    assert np.allclose(found[:2, 4:6], -np.diag([1 / 20, 1 / 30]), atol=1e-12)


def test_stretched_springs_also_transmit_a_couple(rng: np.random.Generator) -> None:
    """d x q: what equal moments at both ends leave out."""
    values = numbers("hinge_spring_planar_rigid_rigid", rng)
    values["q_s"] *= 0
    found = matrix("hinge_spring_planar_rigid_rigid", values)
    x, y = values["d_s"].ravel()
    assert np.allclose(found[3, 4:6], [y, -x])
