"""M^-1 times columns by both engines, against dense mass matrices."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.random import Generator
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.engine import compiled_derivatives
from tests.reference import newton_euler as dense
from tests.reference.compare import fresh
from tests.reference.jets import Array
from tests.reference.tree import SIZES, read
from tests.support.models import looped_model
from tests.support.scenes.random_flexible import varied_scene

#: Relative residual of a scaled system whose condition is 1; it may grow with the condition.
ACCURACY = 1e-13


def compiled_solver_model(scene: dict[str, Any]) -> mstmm.Model:
    """A model that solves by code compiled for its scene."""
    model = mstmm.compile(mstmm.Scene(**scene))
    model._solver.build()
    assert model._solver.uses_compiled_code
    return model


def free_speeds(scene: dict[str, Any]) -> NDArray[np.bool_]:
    """Which speeds no drive prescribes."""
    free = [text == "free" for hinge in read(scene).hinges for text in hinge.drive]
    return np.array(free, dtype=bool)


def check(matrix: Array, columns: Array, answers: Array, free: NDArray[np.bool_]) -> None:
    """Answers solve the free part of the system, and are zero on what is prescribed."""
    assert np.all(answers[~free] == 0)
    if not free.any():
        return
    m, b, x = matrix[np.ix_(free, free)], columns[free], answers[free]
    size = np.sqrt(np.diag(m))
    scaled, right, found = m / np.outer(size, size), b / size[:, None], x * size[:, None]
    expected = np.linalg.solve(scaled, right)
    error = np.abs(found - expected).max() / np.abs(expected).max()
    assert error < ACCURACY * max(10.0, np.linalg.cond(scaled))


@pytest.mark.parametrize("draw", range(6))
def test_random_trees_against_the_dense_mass_matrix(draw: int, rng: Generator) -> None:
    scene, q, _ = fresh(rng)
    model = looped_model(scene)
    columns = rng.standard_normal((model.nu, 4))
    check(dense.mass_matrix(scene, q), columns, model.solve(q, columns), free_speeds(scene))


@pytest.mark.parametrize("kind", SIZES)
def test_chains_of_one_type(kind: str, rng: Generator) -> None:
    scene, q, _ = fresh(rng, types=(kind,), chain=True, most=4)
    model = looped_model(scene)
    columns = rng.standard_normal((model.nu, 3))
    check(dense.mass_matrix(scene, q), columns, model.solve(q, columns), free_speeds(scene))


@pytest.mark.parametrize("draw", range(2))
def test_compiled_code_gives_the_same(draw: int, rng: Generator) -> None:
    scene, q, _ = fresh(rng, most=5)
    looped, fused = looped_model(scene), compiled_solver_model(scene)
    columns = rng.standard_normal((looped.nu, 11))  # more than a group of lanes
    answers = fused.solve(q, columns)
    check(dense.mass_matrix(scene, q), columns, answers, free_speeds(scene))
    check(dense.mass_matrix(scene, q), columns, looped.solve(q, columns), free_speeds(scene))


def test_flexible_bodies_by_both_engines(rng: Generator) -> None:
    """Sections inward and outward, idle ends, drag and springs that must not be felt."""
    scene = varied_scene(int(rng.integers(2**32)), most=3)
    looped, fused = looped_model(scene), compiled_solver_model(scene)
    q = looped.initial_state()[0]
    matrix = looped.mass_matrix(q)
    columns = rng.standard_normal((looped.nu, 3))
    answers = looped.solve(q, columns)
    free = np.any(answers != 0, axis=1)
    assert free.sum() >= looped.nu - 6
    check(matrix, columns, answers, free)
    check(matrix, columns, fused.solve(q, columns), free)


def test_it_is_the_derivative_of_accelerations_by_efforts(rng: Generator) -> None:
    """Loads, laws, speeds and time have no part in it."""
    scene, q, u = fresh(rng)
    model = looped_model(scene)
    found = model.solve(q, np.eye(model.nu))
    expected = model.derivatives(q, u, 0.3).efforts
    size = np.sqrt(np.maximum(np.diag(expected), np.finfo(float).tiny))
    assert np.abs((found - expected) / np.outer(size, size)).max(initial=0.0) < 1e-10


# --- shapes -----------------------------------------------------------------------------------

ARM: dict[str, Any] = {
    "schema_version": 1,
    "gravity": [0, -9.81, 0],
    "body": [
        {"name": name, "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.1, 0.2, 0.2],
         "ends": {"tip": [1, 0, 0]}}
        for name in ("upper", "lower")
    ],
    "hinge": [
        {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "upper",
         "axis": [0, 0, 1]},
        {"name": "elbow", "type": "pin", "inboard": "upper.tip", "outboard": "lower",
         "axis": [0, 0, 1]},
    ],
}  # fmt: skip


def test_shapes_are_those_of_numpy() -> None:
    model, q = looped_model(ARM), np.array([[0.1, 0.2], [0.3, -1.0], [0.0, 2.0]])
    matrices = model.mass_matrix(q)
    one, many = np.array([1.0, -2.0]), np.arange(6.0).reshape(2, 3)
    np.testing.assert_allclose(model.solve(q[0], one), np.linalg.solve(matrices[0], one))
    assert model.solve(q[0], one).shape == (2,)
    np.testing.assert_allclose(model.solve(q[0], many), np.linalg.solve(matrices[0], many))
    found = model.solve(q, many)
    assert found.shape == (3, 2, 3)
    np.testing.assert_allclose(found, np.linalg.solve(matrices, many))
    each = np.arange(12.0).reshape(3, 2, 2)
    np.testing.assert_allclose(model.solve(q, each), np.linalg.solve(matrices, each))
    assert model.solve(q, one).shape == (3, 2)
    assert model.solve(q[0], np.empty((2, 0))).shape == (2, 0)
    assert model.solve(np.empty((0, 2)), np.empty((0, 2, 3))).shape == (0, 2, 3)
    assert model.solve(q[0], np.empty((0, 2, 3))).shape == (0, 2, 3)


@pytest.mark.parametrize(
    ("rhs", "said"),
    [
        ([1.0, 2.0, 3.0], "rhs has shape (3,), expected (2,) or (..., 2, columns)"),
        ([[1.0, 2.0, 3.0]], "rhs has shape (1, 3), expected (2,) or (..., 2, columns)"),
        ([[1.0], [np.nan]], "rhs[1, 0] = nan: expected a finite number"),
    ],
)
def test_what_does_not_fit_is_said(rhs: Any, said: str) -> None:
    with pytest.raises(mstmm.SceneError) as error:
        looped_model(ARM).solve([0.0, 0.0], rhs)
    assert str(error.value) == said


def test_shapes_that_do_not_fit_are_told_as_they_were_given() -> None:
    with pytest.raises(mstmm.SceneError, match=r"q \(3, 2\), rhs \(4, 2, 5\)"):
        looped_model(ARM).solve(np.zeros((3, 2)), np.zeros((4, 2, 5)))


def test_a_motion_without_inertia_is_named_by_both_engines() -> None:
    """A thin rod that turns into the first axis of its universal hinge, about which it has none."""
    rod = {"name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0, 0.1, 0.1]}
    joint = {
        "name": "cross", "type": "universal", "inboard": "ground", "outboard": "rod",
        "axis": [1, 0, 0], "axis2": [0, 0, 1], "initial": {"q": [0.0, 1.0]},
    }  # fmt: skip
    # A load that is no number at t = 0 has no part in it, and is not to blame.
    wind = {"on": "rod", "force": ["1/t", 0, 0]}
    scene = {"schema_version": 1, "gravity": [0, 0, 0], "body": [rod], "hinge": [joint],
             "load": [wind]}  # fmt: skip
    for model in (looped_model(scene), compiled_solver_model(scene)):
        assert model.solve([0.0, 1.0], [1.0, 1.0]).shape == (2,)
        with pytest.raises(mstmm.NumericalFailure, match=r'hinge "cross".*undetermined'):
            model.solve([0.0, 0.0], np.eye(2))


def test_the_compiler_waits_until_it_pays(monkeypatch: pytest.MonkeyPatch) -> None:
    model = mstmm.compile(mstmm.Scene(**ARM))
    model.solve([0.1, 0.2], np.eye(2))
    assert not model._solver.uses_compiled_code
    monkeypatch.setattr(compiled_derivatives, "_COMPILE_SECONDS", 0.0)
    monkeypatch.setattr(compiled_derivatives, "_COMPILE_SECONDS_PER_PAIR", 0.0)
    model.solve([0.1, 0.2], np.eye(2))
    assert model._solver.uses_compiled_code


def test_the_compiler_waits_longer_for_longer_code(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 20 balls it takes most of a minute; a million numbers come from the loop in an instant."""
    model = mstmm.compile(mstmm.Scene(**balls(20)))
    built: list[bool] = []
    monkeypatch.setattr(model.fusion, "solution", lambda build: built.append(build))
    model.solve(model.initial_state()[0], np.ones((model.nu, 1_000_000 // model.nu)))
    assert built == [False]  # looked for, and no more


def balls(count: int) -> dict[str, Any]:
    link = {"mass": 1.0, "center_of_mass": [0.5, 0.1, 0], "inertia": [0.01, 0.1, 0.1],
            "ends": {"tip": [1, 0, 0.1]}}  # fmt: skip
    rope = {"name": "rope", "count": count, "inboard": "ground", "body": [link]}
    return {"gravity": [0, 0, 0], "chain": [rope | {"hinge": [{"type": "ball"}]}]}
