"""What users hand to a model: shapes, kinds and settings are checked in one place, by name."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.scenes.results import pins

Q = np.array([0.3, 0.4])
U = np.array([0.1, -0.2])
MANY = np.array([Q, Q + 1.0, Q - 2.0])


@pytest.fixture(scope="module")
def model() -> mstmm.Model:
    return mstmm.compile(pins(2, [0.3, 0.4]), engine="looped")  # fused code may lie in the cache


def test_the_mass_matrix_of_a_batch_is_that_of_each_state(model: mstmm.Model) -> None:
    found = model.mass_matrix(MANY)
    assert found.shape == (3, 2, 2)
    np.testing.assert_array_equal(found, [model.mass_matrix(q) for q in MANY])
    assert model.mass_matrix(MANY[:, None]).shape == (3, 1, 2, 2)


def test_inverse_dynamics_of_a_batch_gives_the_accelerations_back(model: mstmm.Model) -> None:
    udot = np.array([[0.5, -1.0], [2.0, 0.0], [-3.0, 1.5]])
    efforts = model.inverse_dynamics(MANY, U, udot, [0.0, 1.0, 2.0])
    assert efforts.shape == (3, 2)
    np.testing.assert_allclose(model.accelerations(MANY, U, efforts=efforts), udot, atol=1e-12)


def test_efforts_may_be_the_only_batch(model: mstmm.Model) -> None:
    efforts = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    found = model.accelerations(Q, U, efforts=efforts)
    np.testing.assert_array_equal(found, [model.accelerations(Q, U, efforts=e) for e in efforts])
    assert model.derivatives(Q, U, efforts=efforts).q.shape == (3, 2, 2)


def test_a_number_alone_is_the_row_of_one_coordinate() -> None:
    alone = mstmm.compile(pins(1, [0.3]))
    assert alone.accelerations(0.3, 0.0) == alone.accelerations([0.3], [0.0])
    assert alone.mass_matrix(0.3).shape == (1, 1)


Call = Callable[[Any], Any]  # on purpose with arguments of the wrong type
MISFITS: dict[str, tuple[Call, str]] = {
    "one state of several": (
        lambda m: m.simulate(0.1, initial=(MANY, U)),
        "initial q has shape (3, 2), expected (2,), one state; simulate_batch takes many",
    ),
    "speeds of several": (
        lambda m: m.simulate(0.1, initial=(Q, MANY)), "initial u has shape (3, 2)",
    ),
    "equilibrium of several": (
        lambda m: m.equilibrium(MANY), "q has shape (3, 2), expected (2,), one state",
    ),
    "a misfit of width": (lambda m: m.mass_matrix([0.1]), "q has shape (1,), expected (..., 2)"),
    "a misfit of rows": (
        lambda m: m.accelerations(MANY, MANY[:2]),
        "shapes do not match: t (), q (3, 2), u (2, 2); expected the same number of states in each",
    ),
    "rows of derivatives": (lambda m: m.derivatives(MANY, MANY[:2]), "shapes do not match"),
    "efforts of other rows": (
        lambda m: m.accelerations(MANY, U, efforts=MANY[:2]), "efforts (2, 2)",
    ),
    "rows of unequal length": (
        lambda m: m.accelerations([[0.1, 0.2], [0.3]], U), "with rows of equal length",
    ),
    "text": (lambda m: m.accelerations("30 deg", U), "q = '30 deg': expected an array of real"),
    "masked numbers": (
        lambda m: m.inverse_dynamics(Q, U, np.ma.masked_equal([1.0, 0.0], 0.0)),
        ": expected an array of real numbers",
    ),
    "a masked number": (lambda m: m.simulate(np.ma.masked), "t_end = masked: expected a time"),
    "rows with a mask": (
        lambda m: m.simulate_batch(([np.ma.masked_equal([1.0, 0.0], 0.0)], [U]), t_end=0.1),
        "expected an array of real numbers",
    ),
    "complex numbers": (lambda m: m.inverse_dynamics(Q, U, [1j, 0]), "udot = [1j, 0]"),
    "no number": (lambda m: m.accelerations(Q, [np.nan, 0]), "u[0] = nan: expected a finite"),
    "no time": (lambda m: m.accelerations(Q, U, np.inf), "t = inf: expected a finite number"),
    "a time of several": (lambda m: m.equilibrium(t=[0, 1]), "t = [0, 1]: expected a time in s"),
    "half a state": (lambda m: m.simulate(0.1, initial=Q[:1]), "initial: expected two arrays"),
    "half a batch": (
        lambda m: m.simulate_batch((Q,), t_end=0.1), "initial_states: expected two arrays",
    ),
    "threads": (lambda m: m.simulate_batch((Q, U), t_end=0.1, threads=0), "threads = 0"),
    "a table of parameters": (lambda m: m.with_parameters([1.0]), "expected numbers by their"),
    "a table of parameters of a batch": (
        lambda m: m.simulate_batch((Q, U), [1.0], t_end=0.1), "expected numbers by their",
    ),
    "a parameter of several": (
        lambda m: m.with_parameters({"rod0.mass": [1, 2]}),
        'parameter "rod0.mass" = [1, 2]: expected a finite number',
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MISFITS)
def test_what_does_not_fit_is_refused_by_name(model: mstmm.Model, case: str) -> None:
    call, message = MISFITS[case]
    with pytest.raises(mstmm.SceneError, match=re.escape(message)):
        call(model)


SETTINGS: dict[str, tuple[dict[str, Any], str]] = {
    "times that fall": ({"output_times": [0.5, 0.2, 1.0]}, "0.2 s follows 0.5 s"),
    "a time twice": ({"output_times": [0.5, 0.5]}, "0.5 s follows 0.5 s"),
    "no time": ({"output_times": [0.5, np.nan]}, "output_times[1] = nan"),
    "times beyond the end": ({"output_times": [0.5, 2.0]}, "between t_start = 0 and t_end = 1"),
    "times in rows": ({"output_times": [[0.0, 0.5]]}, "output_times have shape (1, 2)"),
    "times as text": ({"output_times": "all"}, "output_times = 'all'"),
    "one whole number": (
        {"output_times": 1},
        "output_times = 1: expected times in s, found an integer",
    ),
    "one whole number of NumPy": (
        {"output_times": np.int64(301)},
        "write [301.0] for one sample at",
    ),
    "no rtol": ({"rtol": np.nan}, "rtol = nan"),
    "endless rtol": ({"rtol": np.inf}, "rtol = inf"),
    "negative rtol": ({"rtol": -1e-9}, "rtol = -1e-09"),
    "rtol zero": ({"rtol": 0}, "rtol = 0: expected a relative tolerance above zero"),
    "text as rtol": ({"rtol": "1e-9"}, "rtol = '1e-9'"),
    "no atol": ({"atol": np.nan}, "atol = nan"),
    "atol zero": ({"atol": 0}, "atol = 0: expected an absolute tolerance above zero"),
    "several atol": ({"atol": [1e-9, 1e-6]}, "atol = [1e-09, 1e-06]"),
    "no start": ({"t_start": np.nan}, "t_start = nan"),
    "an end before the start": ({"t_start": 2.0}, "t_end = 1: expected a time in s, not before"),
    "a method that is no name": ({"method": ["dop853"]}, "method = ['dop853']"),
}


@pytest.mark.parametrize("method", ["dop853", "scipy-RK45"])
@pytest.mark.parametrize("case", SETTINGS)
def test_settings_are_refused_by_name_for_every_integrator(
    model: mstmm.Model, method: str, case: str
) -> None:
    changes, message = SETTINGS[case]
    with pytest.raises(mstmm.SceneError, match=re.escape(message)):
        model.simulate(1.0, **({"method": method} | changes))


@pytest.mark.parametrize("method", ["dop853", "scipy-RK45"])
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"max_step": np.nan}, "max_step = nan"),
        ({"max_step": -0.1}, "max_step = -0.1"),
        ({"max_steps": 1.5}, "max_steps = 1.5: expected a whole number"),
    ],
)
def test_options_of_methods_are_refused_by_name_for_every_integrator(
    model: mstmm.Model, method: str, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(mstmm.SceneError, match=re.escape(message)):
        model.simulate(1.0, mstmm.methods.Method(method, **options))


@pytest.mark.parametrize("method", ["dop853", "scipy-RK45"])
def test_the_smallest_tolerance_is_certified_like_any_other(
    model: mstmm.Model, method: str
) -> None:
    run = model.simulate(0.1, method=method, rtol=1e-6, atol=5e-324, certify=True)
    assert run.success and run.certificate.error is not None


def test_one_time_is_a_float(model: mstmm.Model) -> None:
    for one in (1.0, np.float64(1.0), [1]):
        assert model.simulate(1.0, output_times=one).t.tolist() == [1.0]
    with pytest.raises(mstmm.SceneError, match=re.escape("numpy.linspace(t_start, t_end, 301)")):
        model.simulate_batch((Q, U), t_end=1.0, output_times=301)


def test_a_batch_of_none(model: mstmm.Model) -> None:
    batch = model.simulate_batch((np.zeros((0, 2)), U), t_end=0.1)
    assert batch.q.shape == (0, 1, 2) and batch.success.shape == (0,)


def test_numbers_of_other_libraries_are_numbers(model: Any) -> None:
    limits: dict[str, Any] = {"max_steps": np.int64(1000), "max_step": np.inf}
    run = model.simulate(
        np.float32(0.5),
        mstmm.methods.Method(**limits),
        rtol=np.float64(1e-6),
        output_times=np.array([0, 0.5], np.float32),
    )
    assert run.success and list(run.t) == [0.0, 0.5]


@pytest.mark.parametrize("name", ["step", "rtol", "t_end"])
def test_a_number_beyond_all_floats_is_refused(model: Any, name: str) -> None:
    with pytest.raises(mstmm.SceneError, match=f"{name} exceeds 1.8e308: expected"):
        model.simulate(**{"t_end": 0.1, name: 10**5000})


@pytest.mark.filterwarnings("error")
def test_numbers_whose_squares_are_none_raise_no_warning(model: mstmm.Model) -> None:
    """They are finite; what becomes of them the run says."""
    far = np.full((3, model.nq), 1e300)
    ended = model.simulate_batch((far, np.zeros((3, model.nu))), t_end=0.1)
    assert ended.q.shape[0] == 3
    with pytest.raises(mstmm.SceneError, match=r"initial u\[0, 0\] = inf"):
        model.simulate_batch((far, np.full((3, model.nu), np.inf)), t_end=0.1)


@pytest.mark.parametrize("names", [(), ("rod0.mass",)])
def test_derivatives_are_written_into_those_of_an_earlier_call(
    model: mstmm.Model, names: tuple[str, ...]
) -> None:
    room, found = (model.derivatives(q, U, parameters=names) for q in (Q, Q + 0.5))
    kept = [room.q, room.udot, *room.parameters.values()]
    assert model.derivatives(Q + 0.5, U, parameters=names, out=room) is room
    for a, b in zip(kept, [found.q, found.udot, *found.parameters.values()], strict=True):
        np.testing.assert_array_equal(a, b)
    with pytest.raises(mstmm.SceneError, match="out: expected a writeable float64 array"):
        model.derivatives(MANY, U, parameters=names, out=room)
    with pytest.raises(mstmm.SceneError, match="the result of an earlier call of derivatives"):
        model.derivatives(Q, U, parameters=["rod1.mass"], out=room)
