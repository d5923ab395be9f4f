"""Natural motions: closed forms, published numbers, and counts that miss none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigvalsh_tridiagonal
from scipy.special import jn_zeros

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.linear import lanczos_iteration
from mstmm.runtime.linear.mode_solvers import ModeCounter
from tests.support.paths import EXAMPLES
from tests.support.scenes.linear import beads, column, hanging, hanging_beam, masses, pendulum


def compile_looped(scene: mstmm.Scene) -> mstmm.Model:
    return mstmm.compile(scene, engine="looped")


@pytest.mark.parametrize("count", [5, 50, 500])
def test_masses_in_a_row(count: int) -> None:
    """2 sqrt(k/m) sin((2 j - 1) pi / (4 N + 2)): all of few, the first ten of many."""
    modes = compile_looped(masses(count, 0.5, 200.0)).modes(min(count, 10))
    j = np.arange(1, 1 + min(count, 10))
    expected = 2 * np.sqrt(200 / 0.5) * np.sin((2 * j - 1) * np.pi / (4 * count + 2))
    np.testing.assert_allclose(modes.omega, expected, rtol=1e-8)
    assert modes.is_complete and modes.is_undamped and not modes.damping_ratio.any()
    np.testing.assert_allclose(modes.frequency * 2 * np.pi, modes.omega)


@pytest.mark.parametrize("count", [5, 50, 500])
def test_beads_on_a_string(count: int) -> None:
    """omega^2 l/g are the zeros of Laguerre's polynomial L_N (Euler), the eigenvalues of its
    recurrence: all of few, the first ten of many."""
    modes = compile_looped(beads(count)).modes(min(count, 10))
    zeros = eigvalsh_tridiagonal(2.0 * np.arange(count) + 1, np.arange(1.0, count))
    expected = np.sqrt(9.81 / 0.2 * zeros[: len(modes)])
    np.testing.assert_allclose(modes.omega, expected, rtol=1e-8)
    assert modes.is_complete


def test_few_of_many_are_those_of_the_matrices() -> None:
    linear = compile_looped(hanging(450)).linearize()
    few, every = linear.modes(12), linear.modes()
    np.testing.assert_allclose(few.omega, every.omega[:12], rtol=1e-9)
    signs = np.sign(np.sum(few.shapes * every.shapes[:, :12], axis=0))
    np.testing.assert_allclose(few.shapes * signs, every.shapes[:, :12], atol=1e-6)
    np.testing.assert_allclose(few.effective_modal_mass, every.effective_modal_mass[:12], atol=1e-8)


def test_few_vectors_are_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is no room for more, the search goes on from what it has."""
    linear = compile_looped(hanging(450)).linearize(disturbances=())
    expected = linear.modes(10)
    monkeypatch.setattr(lanczos_iteration, "_VECTORS_PER_MODE", 1)
    monkeypatch.setattr(lanczos_iteration, "_EXTRA_VECTORS", 14)
    modes = linear.modes(10)
    assert modes.is_complete
    np.testing.assert_allclose(modes.omega, expected.omega, rtol=1e-9)
    units = np.einsum("ik,ij,jl->kl", modes.shapes, linear.M, modes.shapes)
    np.testing.assert_allclose(units, np.eye(10), atol=1e-9)
    monkeypatch.setattr(lanczos_iteration, "_MAX_RUNS", 1)
    with pytest.raises(NumericalFailure, match="of 12 modes found"):
        linear.modes(10)


def test_none_is_missed_of_ten_thousand() -> None:
    """The heavy chain of D. Bernoulli: zeros of J0 times sqrt(g/l)/2, from which rods deviate with
    the square of their number in a wave; and the count agrees."""
    modes = compile_looped(hanging(10_000)).modes(20)
    np.testing.assert_allclose(modes.omega, jn_zeros(0, 20) / 2 * np.sqrt(9.81), rtol=7e-5)
    assert modes.is_complete


def test_equal_frequencies_are_all_found() -> None:
    """Two hundred pendulums on one beam of their own: each frequency three times."""
    chains = [
        {"name": name, "count": 150, "inboard": "ground", "end": "on",
         "body": {"mass": 1.0, "center_of_mass": [0, 0, 0], "inertia": [1, 1, 1],
                  "ends": {"on": [0, 0, 0]}},
         "hinge": {"type": "prismatic", "axis": [1, 0, 0], "law": {"stiffness": 100.0}}}
        for name in ("one", "two", "three")
    ]  # fmt: skip
    modes = compile_looped(mstmm.Scene(gravity=(0, 0, 0), chain=chains)).modes(7)
    j = np.repeat(np.arange(1, 4), 3)[:7]
    np.testing.assert_allclose(modes.omega, 20 * np.sin((2 * j - 1) * np.pi / 602), rtol=1e-8)
    assert modes.is_complete


def sprung_rods(count: int, stiffness: float) -> mstmm.Scene:
    """Rods in space on pins and universal hinges, with springs under tension from one to others."""
    rod = {"mass": 1.0, "center_of_mass": [0.3, 0, 0], "inertia": [0.1, 0.2, 0.3],
           "ends": {"tip": [0.6, 0, 0]}}  # fmt: skip
    kinds: list[dict[str, Any]] = [
        {"type": "universal", "axis2": [0, 1, 0], "law": {"stiffness": [100.0, 100.0]}},
        {"type": "pin", "law": {"stiffness": 100.0}},
    ]
    return mstmm.Scene(
        gravity=(0, -1, 0),
        body=[{**rod, "name": f"b{k}"} for k in range(count)],
        hinge=[{"name": f"h{k}", "inboard": f"b{k - 1}.tip" if k else "ground",
                "outboard": f"b{k}", **kinds[k % 2]} for k in range(count)],
        spring=[{"name": f"s{k}", "from": f"b{k}", "to": f"b{k + 3}.tip",
                 "law": {"stiffness": stiffness, "rest": 0.5}} for k in range(0, count - 3, 2)],
    )  # fmt: skip


@pytest.mark.parametrize("stiffness", [40.0, 2000.0])
def test_springs_between_bodies_are_counted(stiffness: float) -> None:
    """Between any two omega^2 of the matrices, and beyond."""
    linear = compile_looped(sprung_rods(12, stiffness)).linearize(disturbances=())
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(linear.M, linear.K)).real)
    edges = [squares[0] - 1, *(squares[1:] + squares[:-1]) / 2, 1.1 * squares[-1]]
    counting = ModeCounter(linear.operators)
    assert [counting.count_below(edge) for edge in edges] == list(range(len(squares) + 1))


def test_few_of_many_with_springs_between_are_complete() -> None:
    """Masses in a row, 10 cm apart, with long springs: by the matrices of those springs."""
    scene = masses(410, 0.5, 200.0).model_dump(by_alias=True)
    scene["chain"][0]["body"][0]["ends"]["on"]["position"] = [0.1, 0, 0]
    ties = [(20, 300), (100, 104), (200, 409)]
    scene["spring"] = [
        {"name": f"tie{k}", "from": f"row[{a}]", "to": f"row[{b}]",
         "law": {"stiffness": 50.0, "rest": 0.1 * (b - a)}} for k, (a, b) in enumerate(ties)
    ]  # fmt: skip
    modes = compile_looped(mstmm.Scene(**scene)).modes(8)
    pulls = np.array([np.eye(410)[b] - np.eye(410)[a] for a, b in ties])
    steps = np.eye(410) - np.eye(410, k=-1)
    squares = np.linalg.eigvalsh(200 * steps.T @ steps + 50 * pulls.T @ pulls) / 0.5
    np.testing.assert_allclose(modes.omega, np.sqrt(squares[:8]), rtol=1e-8)
    assert modes.is_complete


def test_loads_that_follow_other_bodies_are_not_counted() -> None:
    """They have no potential, and no count."""
    scene = sprung_rods(6, 40.0).model_dump(by_alias=True, exclude_defaults=True)
    load = {"on": "b2", "force": ["3*h3.q", 0, 0]}
    linear = compile_looped(mstmm.Scene(**(scene | {"load": [load]}))).linearize(disturbances=())
    assert ModeCounter(linear.operators).count_below(10.0) is None


#: Frequencies of a beam of length and mass per length 1 that hangs on a pin under 9.81 m/s2, by
#: stiffness: 60 Hermite elements with their geometric stiffness.
HANGING = {1.0: (3.81917, 18.09284, 52.48919), 0.05: (3.77647, 9.72380, 19.13301)}


@pytest.mark.parametrize("stiffness", list(HANGING))
def test_a_beam_that_hangs(stiffness: float) -> None:
    modes = compile_looped(hanging_beam(stiffness)).modes(3)
    np.testing.assert_allclose(modes.omega, HANGING[stiffness], rtol=3e-6)
    assert modes.is_complete


def test_a_free_body_has_motions_of_frequency_zero() -> None:
    model = mstmm.compile(mstmm.load_scene(EXAMPLES / "satellite_panels" / "scene.toml"))
    linear = model.linearize()
    modes = linear.modes()
    assert not modes.omega[:6].any() and modes.omega[6] > 1 and not modes.unstable.any()
    assert any("no stiffness acts on space.vx_increment" in text for text in linear.warnings)
    np.testing.assert_allclose(
        modes.effective_modal_mass.sum(axis=0), 136.0
    )  # both panels and the hub
    strain = modes.strain_energy_shares()
    assert np.isnan(strain["space"][:6]).all()
    np.testing.assert_allclose(strain["east"][6:] + strain["west"][6:], 1.0)


def test_many_bodies_that_float_have_motions_of_frequency_zero() -> None:
    """And none of them grows by rounding."""
    rod = {"mass": 0.01, "center_of_mass": [0.005, 0, 0], "inertia": [1e-9, 1e-7, 1e-7],
           "ends": {"tip": [0.01, 0, 0]}}  # fmt: skip
    scene = mstmm.Scene(
        gravity=(0, 0, 0), body=[{"name": "hub", "mass": 0.02, "inertia": [1e-6] * 3}],
        hinge=[{"name": "space", "type": "free", "inboard": "ground", "outboard": "hub"}],
        chain=[{"name": "tail", "count": 420, "inboard": "hub", "body": rod, "end": "tip",
                "hinge": {"type": "pin", "law": {"stiffness": 50.0}}}],
    )  # fmt: skip
    linear = compile_looped(scene).linearize(disturbances=())
    few, every = linear.modes(9), linear.modes()
    assert few.is_complete and not few.omega[:6].any() and not few.unstable.any()
    np.testing.assert_allclose(few.omega[6:], every.omega[6:9], rtol=1e-6)


def test_effective_masses_add_up() -> None:
    modes = compile_looped(hanging(30)).modes()
    linear = modes.linear
    rigid = linear.W[:, 0] @ np.linalg.solve(linear.M, linear.W[:, 0])
    assert modes.effective_modal_mass[:, 0].sum() == pytest.approx(rigid) and rigid < 1.0


@pytest.mark.parametrize(("damping", "ratio"), [(0.5, 0.25), (2.0, 1.0), (4.0, 2.0)])
def test_damping_in_parts_of_the_critical_one(damping: float, ratio: float) -> None:
    scene = masses(1, 1.0, 1.0)
    chain = scene.model_dump(by_alias=True)["chain"][0]
    chain["hinge"][0]["law"] = {"stiffness": 1.0, "damping": damping}
    modes = compile_looped(mstmm.Scene(gravity=(0, 0, 0), chain=[chain])).modes()
    expected = np.roots([1, damping, 1])
    kept = expected[expected.imag >= 0]
    np.testing.assert_allclose(np.sort(modes.eigenvalues), np.sort(kept), atol=3e-8)
    if ratio < 1:
        assert modes.damping_ratio[0] == pytest.approx(ratio) and modes.omega[0] == pytest.approx(
            1.0
        )
    assert (
        compile_looped(mstmm.Scene(gravity=(0, 0, 0), chain=[chain]))
        .modes(damped=False)
        .is_undamped
    )


def test_damped_motions_of_many() -> None:
    """Stiffness and damping of one kind: s^2 + d s + 1 times each omega^2."""
    chain = masses(500, 0.5, 200.0).model_dump(by_alias=True)["chain"][0]
    chain["hinge"][0]["law"] = {"stiffness": 200.0, "damping": 0.02}
    modes = compile_looped(mstmm.Scene(gravity=(0, 0, 0), chain=[chain])).modes(6)
    omega = 40 * np.sin((2 * np.arange(1, 7) - 1) * np.pi / 2002)
    np.testing.assert_allclose(modes.omega, omega, rtol=1e-8)
    np.testing.assert_allclose(modes.damping_ratio, omega * 0.02 / 200 / 2, rtol=1e-6)
    assert modes.is_complete is None


def test_shapes_are_states() -> None:
    model = compile_looped(hanging(3))
    modes = model.modes()
    moved = modes.displaced_state(0, 0.1)
    np.testing.assert_allclose(moved, 0.1 * modes.shapes[:, 0])
    run = model.simulate(2 * np.pi / modes.omega[0], initial=(1e-4 * moved, np.zeros(3)))
    np.testing.assert_allclose(run.q[-1], 1e-4 * moved, atol=1e-9)  # there again a period later


def test_a_pendulum_that_stands_is_unstable_and_linear_all_the_same() -> None:
    linear = compile_looped(pendulum()).linearize([np.pi])
    (text,) = linear.warnings
    assert "unstable: a motion of pivot.angle grows at a rate of 4.302 1/s" in text
    assert linear.modes().unstable.all() and linear.modes().eigenvalues[0] > 0


def test_states_that_do_not_last_are_told() -> None:
    model = compile_looped(pendulum())
    assert "is not steady: pivot.angle" in model.linearize([0.3]).warnings[0]
    assert not model.linearize().warnings
    turning = compile_looped(hanging(2)).linearize([0, 0], [1.0, 0.0])
    assert turning.warnings
    timed = pendulum(law={"effort": "sin(t)"})
    texts = compile_looped(timed).linearize([0.0]).warnings
    assert "is not steady: as loads or drives change with time" in texts[0]
    assert "depend on time" in texts[1]


def test_what_makes_no_sense() -> None:
    model = compile_looped(pendulum())
    linear = model.linearize()
    for count in (0, 2, True):
        with pytest.raises(SceneError, match="expected a number of modes from 1 to 1"):
            linear.modes(count)
    for wrong in (1.5, "a"):
        with pytest.raises(SceneError, match="expected a whole number of modes"):
            linear.modes(wrong)  # type: ignore[arg-type]
    for k in (1, -1, True, "a"):
        with pytest.raises(SceneError, match="expected the index of one of"):
            linear.modes().dominant_coordinates(k)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match=r'"pivot.efort".*did you mean "?pivot.effort'):
        model.linearize(inputs=["pivot.efort"])
    with pytest.raises(SceneError, match=r"bob\.tip\.force\.w"):
        model.linearize(inputs=["bob.tip.force.w"])
    for names, found in (
        ("pivot.effort", r'such as \["pivot.effort"\]'),
        ([None], "list of names"),
    ):
        with pytest.raises(SceneError, match=found):
            model.linearize(inputs=names)  # type: ignore[arg-type]
        with pytest.raises(SceneError, match=found):
            model.linearize(disturbances=names)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="expected True, False or None"):
        model.modes(damped="no")  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="q has shape"):
        model.linearize([0.0, 1.0])
    with pytest.raises(NumericalFailure, match="no equilibrium"):
        compile_looped(pendulum(law={"effort": 100.0})).linearize()
    with pytest.raises(NumericalFailure, match="no equilibrium"):
        compile_looped(pendulum(law={"effort": 100.0})).modes()


def test_scenes_in_which_nothing_moves_or_rests(recwarn: pytest.WarningsRecorder) -> None:
    body = {"name": "block", "mass": 1.0, "inertia": [1, 1, 1]}
    hinge = {"name": "on", "inboard": "ground", "outboard": "block"}

    def scene(**more: object) -> mstmm.Model:
        return compile_looped(mstmm.Scene(gravity=(0, 0, -9.81), body=[body], hinge=[hinge | more]))

    for still in (scene(type="fixed"), scene(type="pin", drive="sin(t)")):
        assert len(still.modes()) == 0 and not still.linearize().warnings
        assert still.frequency_response([1.0]).response.shape == (1, 0, 3)
        assert repr(still.modes()) == "<Modes: none>"
        with pytest.raises(SceneError, match="no degrees of freedom"):
            still.modes(1)
        with pytest.raises(SceneError, match="no degrees of freedom"):
            still.root_locus("block.mass", [1.0, 2.0])
        with pytest.raises(SceneError, match="no degrees of freedom"):
            still.stability_limit("block.mass", 1.0, 2.0)
        with pytest.raises(SceneError, match="nothing to draw"):
            still.frequency_response([1.0]).plot()
    with pytest.raises(NumericalFailure, match=r"no equilibrium|undetermined"):
        scene(type="free").modes()
    assert not recwarn.list


def test_the_names_of_a_ball() -> None:
    linear = mstmm.compile(mstmm.load_scene(EXAMPLES / "heavy_top" / "scene.toml")).linearize(
        [1, 0, 0, 0]
    )
    assert (
        linear.coordinate_names[0] == "point.wx_increment"
        and linear.coordinate_units == ("rad",) * 3
    )


def test_a_buckled_column_is_found_where_its_frequency_vanishes() -> None:
    squares = [
        float(np.min(np.linalg.eigvals(np.linalg.solve(x.M, x.K)).real))
        for x in (compile_looped(column(load, "inertial", 6)).linearize() for load in (2.0, 2.4))
    ]
    load = 2.0 + 0.4 * squares[0] / (squares[0] - squares[1])
    assert load == pytest.approx(np.pi**2 / 4, rel=1e-3)


def test_metres_and_radians_are_compared_by_sizes() -> None:
    """A cart on a soft spring with a bob on 1 cm: the bob turns by eleven radians a metre, which is
    little beside a metre of a scene that is as small as that."""
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0),
        body=[{"name": "cart", "mass": 1.0, "inertia": [1, 1, 1]},
              {"name": "bob", "mass": 1e-6, "center_of_mass": [0, -0.01, 0]}],
        hinge=[{"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
                "outboard": "cart", "law": {"stiffness": 100.0}},
               {"name": "pin", "type": "pin", "inboard": "cart", "outboard": "bob"}],
    )  # fmt: skip
    modes = mstmm.compile(scene, engine="looped").modes()
    assert abs(modes.shapes[1, 0] / modes.shapes[0, 0]) == pytest.approx(11.35, rel=1e-2)
    assert modes.dominant_coordinates(0) == ["rail.displacement", "pin.angle"]
    assert modes.dominant_coordinates(1) == ["pin.angle"]


def test_findings_about_inputs_and_outputs_are_none_of_the_motions() -> None:
    """The power of the drive has no linear form, and "brake" acts on no motion at rest."""
    scene = mstmm.Scene(
        gravity=[0, -9.81, 0],
        body=[
            {"name": "cart", "mass": 1.0, "inertia": [0.1] * 3},
            {"name": "bob", "mass": 2.0, "center_of_mass": [0, -1.0, 0], "inertia": [0.1] * 3},
        ],
        hinge=[
            {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "cart", "drive": "0"},
            {"name": "swing", "type": "pin", "inboard": "cart", "outboard": "bob",
             "law": {"effort": "-brake*u"}},
        ],
        input=[{"name": "brake"}],
        output=[
            {"name": "motor", "of": "rail.effort*rail.u"},
            {"name": "sway", "of": "2*swing.angle"},
        ],
    )  # fmt: skip
    linear = mstmm.compile(scene, engine="looped").linearize()
    concerned = {"input-without-effect", "output-left-out"}
    assert {risk.name for risk in linear.risks} >= concerned
    assert not concerned & {risk.name for risk in linear.modes().risks}
    assert np.isclose(linear.modes().omega[0], np.sqrt(2 * 9.81 / 2.1))
    for outputs, is_left_out in ((None, True), (["sway"], False)):
        response = linear.frequency_response([1.0], ["swing.effort"], outputs)
        assert ("output-left-out" in {risk.name for risk in response.risks}) == is_left_out
