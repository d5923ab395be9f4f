"""Certificates: they see what is wrong, and find nothing where nothing is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mstmm
from mstmm.runtime.engine.jacobian import fastest_eigenvalue
from mstmm.runtime.result.certificate import Certificate
from mstmm.runtime.result.result import Result
from tests.support.models import model_of
from tests.support.scenes.results import motor, pins, rod, tree
from tests.support.scenes.rods import chain, drawn_state, precise_accelerations


def free_pair(**space: object) -> mstmm.Scene:
    """Two rods joined by a ball, tumbling in space."""
    hinge = {
        "name": "space", "type": "free", "inboard": "ground", "outboard": "rod0",
        "initial": {"u": [0.2, -0.1, 0.3, 0.5, 0.4, -0.9]}, **space,
    }  # fmt: skip
    ball = {
        "name": "ball", "type": "ball", "inboard": "rod0.tip", "outboard": "rod1",
        "initial": {"q": [0.9, 0.1, 0.3, -0.2], "u": [1.0, -2.0, 0.5]},
    }  # fmt: skip
    return mstmm.Scene(gravity=(0, 0, 0), body=[rod("rod0"), rod("rod1")], hinge=[hinge, ball])


# --- balances -------------------------------------------------------------------------------------


def test_energy_and_work_balance_in_a_scene_with_everything() -> None:
    run = mstmm.compile(tree()).simulate(2.0)
    assert 0 < run.certificate.energy.relative < 1e-8
    assert np.ptp(run.energy()) > 0.1  # the balance, not the energy, is what is kept
    assert run.certificate.momentum == () and run.warnings == ()


@pytest.mark.parametrize("wrong", [1e-4, 1e-2])
def test_work_that_does_not_account_for_the_energy_is_seen(wrong: float) -> None:
    run = mstmm.compile(motor("2*sin(t)", damping=0.1)).simulate(2.0)
    exchanged = run.certificate.energy.scale
    ramp = wrong * exchanged * run.t / run.t[-1]
    other = Result(run.model, replace(run.trajectory, work=run.work + ramp))
    assert other.certificate.energy.relative == pytest.approx(wrong, rel=0.02)
    assert any("energy is not conserved" in text for text in other.warnings)
    assert not run.warnings


def test_momentum_of_a_free_scene_in_every_component() -> None:
    run = mstmm.compile(free_pair()).simulate(5.0)
    names = [d.name for d in run.certificate.momentum]
    kinds = ("momentum", "angular momentum")
    assert names == [f"{kind} {axis}" for axis in "xyz" for kind in kinds]
    assert all(0 < d.relative < 1e-8 for d in run.certificate.momentum)
    coarse = model_of(run).simulate(5.0, method="rk4", step=0.2)
    assert any("momentum" in text and "not conserved" in text for text in coarse.warnings)


@pytest.mark.parametrize(
    "change, expected",
    [
        ({"gravity": (0, 0, -9.81)}, {"momentum x", "momentum y", "angular momentum z"}),
        ({"gravity": (0, -3, -9.81)}, {"momentum x"}),
        ({"load": [{"on": "rod1", "force": ["0.1*t", 0, 0]}]}, set()),
        ({"spring": [{"from": "ground", "to": "rod1", "law": {"stiffness": 1.0}}]}, set()),
    ],
)
def test_only_what_is_conserved_is_certified(change: dict[str, object], expected: set[str]) -> None:
    scene = mstmm.Scene.from_data(
        free_pair().model_dump(by_alias=True, exclude_unset=True) | change
    )
    run = mstmm.compile(scene).simulate(1.0)
    assert {d.name for d in run.certificate.momentum} == expected
    assert all(d.relative < 1e-8 for d in run.certificate.momentum)


def test_angular_momentum_about_a_vertical_pin() -> None:
    upright = {"name": "mast", "type": "pin", "inboard": "ground", "outboard": "rod0",
               "initial": {"u": [2.0]}}  # fmt: skip
    joint = {"name": "joint", "type": "pin", "inboard": "rod0.tip", "outboard": "rod1",
             "orientation": [1.2, 0.3, 0], "initial": {"u": [1.0]}}  # fmt: skip
    bodies = [rod("rod0"), rod("rod1")]
    scene = mstmm.Scene(gravity=(0, 0, -9.81), body=bodies, hinge=[upright, joint])
    run = mstmm.compile(scene).simulate(3.0)
    assert [d.name for d in run.certificate.momentum] == ["angular momentum z"]
    held = mstmm.Scene(gravity=(0, 0, -9.81), body=bodies,
                       hinge=[upright | {"law": {"damping": 0.1}}, joint])  # fmt: skip
    assert mstmm.compile(held).simulate(1.0).certificate.momentum == ()


def top(center: float, **given: object) -> mstmm.Scene:
    """A body on a ball, its centre of mass `center` metres from it along z."""
    body = {"name": "top", "mass": 1.0, "inertia": [0.2, 0.2, 0.3],
            "center_of_mass": [0, 0, center]}  # fmt: skip
    ball = {"name": "ball", "type": "ball", "inboard": "ground", "outboard": "top",
            "initial": {"u": [1.0, 2.0, 3.0]}, **given}  # fmt: skip
    gravity = (0, 0, -9.81) if center else (0, 0, 0)
    return mstmm.Scene(gravity=gravity, body=[body], hinge=[ball])


def test_a_body_on_a_ball_keeps_its_angular_momentum() -> None:
    """The ball carries nothing but rounding, against which nothing else can be judged."""
    run = mstmm.compile(top(0.0)).simulate(2.0)
    names = [d.name for d in run.certificate.momentum]
    assert names == [f"angular momentum {axis}" for axis in "xyz"]
    assert all(0 < d.relative < 1e-8 for d in run.certificate.momentum)
    coarse = model_of(run).simulate(2.0, method="rk4", step=0.4)
    assert any("angular momentum" in text and "not conserved" in text for text in coarse.warnings)


@pytest.mark.parametrize("place, about", [([0, 0, 0], ""), ([1.0, 2.0, 3.0], ' about "ball"')])
def test_a_top_keeps_its_angular_momentum_about_the_vertical(
    place: list[float], about: str
) -> None:
    run = mstmm.compile(top(0.3, position=place)).simulate(2.0)
    (drift,) = run.certificate.momentum
    assert drift.name == f"angular momentum z{about}"
    assert 0 < drift.relative < 1e-8
    assert drift.scale == pytest.approx(np.abs(run.angular_momentum()[0]).max(), rel=3)


def test_a_load_along_a_beam_is_a_load() -> None:
    """It changes the momentum of a beam that flies free, however it is written."""
    beam = {"name": "pole", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 10.0,
            "polar_inertia_per_length": 1e-4, "modes": {"y": 2}}  # fmt: skip
    space = {"name": "space", "type": "free", "inboard": "ground", "outboard": "pole"}
    load = {"on": "pole", "force_per_length": [0, 1.0, 0]}
    scene = mstmm.Scene(gravity=(0, 0, 0), beam=[beam], hinge=[space], load=[load])
    run = mstmm.compile(scene).simulate(0.5, rtol=1e-6)
    assert run.certificate.momentum == ()
    assert run.warnings == ()


def test_what_rests_but_for_rounding_keeps_its_energy() -> None:
    """A bead at the bottom of a wire, with no more energy than the last digits of its place."""
    scene = mstmm.Scene(
        gravity=[0, 0, -9.81], body=[{"name": "bead", "mass": 1.0, "inertia": [0.1, 0.12, 0.15]}],
        hinge=[{"name": "loose", "type": "free", "inboard": "ground", "outboard": "bead"}],
        constraint=[{"type": "point-on-curve", "from": "ground", "to": "bead", "start": 0.5,
                     "curve": ["s", "0.2*sin(s)", "0.5*s^2"]}],
    )  # fmt: skip
    result = mstmm.compile(scene, engine="looped").simulate(1.0, certify=True)
    assert np.abs(result.energy()).max() < 1e-20
    assert result.trusted, result.warnings


def test_one_sample_has_no_lines_of_momentum() -> None:
    text = str(mstmm.compile(top(0.0)).simulate(2.0, output_times=[2.0]).certificate)
    assert "energy balance       not determined: the run has only one sample" in text
    assert "angular momentum" not in text


# --- what the estimate covers ---------------------------------------------------------------------


def test_the_table_says_what_a_spring_for_a_constraint_gives_by() -> None:
    """A stiff spring holds the tip of a pinned rod."""
    spring = {"name": "pin", "from": "ground", "to": "rod0.tip", "position": [1, 0.05, 0],
              "law": {"stiffness": 1e4, "damping": 1e2}}  # fmt: skip
    one = pins(1, [0.0]).model_dump(by_alias=True, exclude_unset=True)
    run = mstmm.compile(mstmm.Scene.from_data(one | {"spring": [spring]})).simulate(
        1.0, certify=True, rtol=1e-6
    )
    give = run.certificate.spring_deflection
    assert give is not None
    assert give.spring == 'spring "pin"'
    expected = np.linalg.norm(run.position("rod0.tip") - [1, 0.05, 0], axis=1).max()
    assert give.largest == pytest.approx(expected)
    assert f'up to {expected:.1e} m at the stiffest, spring "pin"' in str(run.certificate)
    assert "scope of the error" not in str(model_of(run).simulate(1.0).certificate)


def test_the_give_of_an_elastic_hinge_is_seen_too() -> None:
    mount = {"name": "mount", "type": "elastic", "inboard": "ground", "outboard": "rod",
             "law": {"stiffness": [1e5, 1e5, 1e5, 1e3, 1e3, 1e3]}}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, -9.81, 0), body=[rod("rod")], hinge=[mount])
    give = mstmm.compile(scene).simulate(0.5, rtol=1e-6).certificate.spring_deflection
    assert give is not None
    assert give.spring == 'hinge "mount"'
    assert 0.5 < give.largest / (9.81 / 1e5) < 4


def test_quaternions_between_steps_are_settled_and_their_residual_kept() -> None:
    run = mstmm.compile(free_pair()).simulate(5.0, rtol=1e-4, output_times=np.linspace(0, 5, 50))
    lengths = np.linalg.norm(run.coordinates("ball"), axis=1)
    assert np.abs(lengths - 1).max() < 1e-15 < 1e-9 < run.certificate.quaternion_drift < 1e-2


# --- conditioning ---------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["pin", "ball"])
def test_pivot_ratio_bounds_the_error_of_the_accelerations(
    kind: str, rng: np.random.Generator
) -> None:
    """Error of udot against long double, in units of 1e-16 times the ratio, over eight decades."""
    for tip in (1.0, 1e2, 1e4, 1e6, 1e8):
        scene = chain([kind] * 8, masses=[1.0] * 7 + [tip])
        q, u = drawn_state(scene, rng)
        model = mstmm.compile(mstmm.Scene.from_data(scene))
        exact = precise_accelerations(scene, q, u)
        error = np.abs(model.accelerations(q, u) - exact).max() / np.abs(exact).max()
        pivot = model.simulate(1e-6, initial=(q, u)).certificate.pivot_loss
        assert pivot is not None
        assert error < 3e-15 * pivot.ratio  # drawn 600 times: at most 5e-16, median 1e-16
        assert 0.1 * tip < pivot.ratio < 30 * tip + 100  # no alarm about what is harmless


def test_long_uniform_chains_are_no_reason_to_warn() -> None:
    run = mstmm.compile(pins(200, [0.1, -0.2] * 100)).simulate(0.01)
    assert run.certificate.pivot_loss is not None and run.certificate.pivot_loss.ratio < 100
    assert not run.warnings


def test_a_heavy_tip_is_warned_about() -> None:
    scene = mstmm.Scene.from_data(chain(["pin"] * 6, masses=[1.0] * 5 + [1e11]))
    run, chosen = (
        mstmm.compile(scene, sweep=s).simulate(1e-3, rtol=1e-5) for s in ("riccati", "auto")
    )
    assert any("heavy body outboard of light ones" in text for text in run.warnings)
    assert not any("heavy body outboard of light ones" in text for text in chosen.warnings)


def gimbal(rate: float, start: float) -> mstmm.Scene:
    body = {"name": "top", "mass": 1.0, "inertia": [0.1, 0.2, 0.3]}
    hinge = {"name": "rings", "type": "gimbal", "inboard": "ground", "outboard": "top",
             "initial": {"q": [0.0, start, 0.0], "u": [0.0, rate, 0.0]}}  # fmt: skip
    return mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[hinge])


def test_the_distance_from_gimbal_lock() -> None:
    near = mstmm.compile(gimbal(0.0, np.pi / 2 - 1e-5)).simulate(0.1).certificate
    assert near.singularity_distance is not None and near.singularity_distance.hinge == "rings"
    assert near.singularity_distance.measure == pytest.approx(1e-5, rel=1e-5)
    assert any("the singularity of its coordinates" in text for text in near.warnings)
    far = mstmm.compile(gimbal(0.3, 0.0)).simulate(1.0).certificate
    assert far.singularity_distance is not None and not far.warnings
    assert far.singularity_distance.measure == pytest.approx(np.cos(0.3), rel=1e-9)
    through = mstmm.compile(gimbal(1.0, 1.0)).simulate(1.0, method="rk4", step=0.3).certificate
    assert through.singularity_distance is not None and through.singularity_distance.measure == 0.0
    assert mstmm.compile(pins(1, [0.1])).simulate(0.1).certificate.singularity_distance is None


# --- fixed steps ----------------------------------------------------------------------------------

OMEGA = np.sqrt(1e4 / (1 / 3))  # of a rod on a pin with 1e4 N m/rad


@pytest.mark.parametrize("stiffness, damping, rate", [
    (1e4, 0.0, OMEGA), (0.0, 50.0, 150.0), (1e4, 2 / 3 * OMEGA * 0.1, OMEGA),
])  # fmt: skip
def test_the_fastest_motion_of_a_pin_with_a_law(
    stiffness: float, damping: float, rate: float
) -> None:
    engine = mstmm.compile(motor("0", stiffness=stiffness, damping=damping)).looped
    value, _ = fastest_eigenvalue(engine, 0.0, np.array([0.3, 0.0]), engine.start_memory())
    assert abs(value) == pytest.approx(rate, rel=1e-6)


def test_the_fastest_motion_of_a_long_chain_is_found_without_a_dense_matrix() -> None:
    from mstmm.runtime.engine import jacobian

    engine = mstmm.compile(pins(90, [0.05, -0.1] * 45, stiffness=1e4)).looped
    y = np.concatenate([np.tile([0.05, -0.1], 45), np.zeros(90)])
    dense = np.linalg.eigvals(
        jacobian._central_differences(engine, 0.0, y, engine.start_memory(), 1e-6 * np.eye(180))
        / 1e-6
    )
    value, _ = fastest_eigenvalue(engine, 0.0, y, engine.start_memory())
    assert abs(value) == pytest.approx(np.abs(dense).max(), rel=0.05)


@pytest.mark.parametrize("part", [0.95, 1.05])
def test_rk4_is_warned_about_where_it_becomes_unstable(part: float) -> None:
    """On a damped motion with h omega either side of the limit; the run itself shows it."""
    step = part * 2.785 / 150.0
    run = mstmm.compile(motor("0", speed=1.0, damping=50.0)).simulate(
        300 * step, method="rk4", step=step
    )
    check = run.certificate.step_stability
    assert check is not None and check.product == pytest.approx(part * 2.785, rel=1e-6)
    assert (check.amplification > 1.0) == (part > 1.0) == (abs(run.u[-1, 0]) > 1.0)
    assert ("step-stability" in {risk.name for risk in run.risks}) == (part > 1.0)
    assert check.stable_step == pytest.approx(2.785 / 150.0, rel=1e-3)
    fine = model_of(run).simulate(1.0, method="rk4", step=0.9 * check.stable_step)
    assert not any("too long" in text for text in fine.warnings)


def test_a_stiff_scene_is_called_so_by_an_adaptive_method() -> None:
    run = mstmm.compile(motor("sin(t)", damping=3e4)).simulate(2.0, method="dopri5", rtol=1e-4)
    assert run.certificate.stability_limited
    assert any("stiff" in text for text in run.warnings)


def test_no_other_method_is_advised_where_the_run_chose() -> None:
    """Stability sets the steps, but so few of them that explicit ones cost less."""
    run = mstmm.compile(motor("sin(t)", damping=100.0)).simulate(2.0, method="auto", rtol=1e-4)
    assert run.statistics is not None and run.statistics.stability_limited
    assert [stretch.method for stretch in run.method_history] == ["dop853"]
    assert not any("stiff" in text for text in run.warnings)


# --- words ----------------------------------------------------------------------------------------


def test_the_certificate_prints_and_names_the_sum_of_local_errors_as_such() -> None:
    run = mstmm.compile(free_pair()).simulate(1.0)
    text = str(run.certificate)
    assert isinstance(run.certificate, Certificate)
    assert "sum of local errors" in text and "(not the error)" in text
    assert "not estimated (certify=True" in text
    assert all(len(line) < 160 for line in text.splitlines())
    with pytest.raises(AttributeError):
        run.certificate.is_finite = False  # type: ignore[misc]
