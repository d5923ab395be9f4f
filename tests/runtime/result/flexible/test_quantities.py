"""Results of runs with flexible bodies: against the engine's own loads and sums, names, files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.result.result import Result
from tests.support.scenes import elastic_bar

Array = NDArray[np.float64]

BODIES = ("hub", "blade", "bob")


def machine(**given: Any) -> mstmm.Scene:
    """A hub on a ball, a beam held by a universal hinge, a bob on its tip, loads of every kind."""
    blade = {
        "name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": [40.0, 60.0],
        "torsional_stiffness": 30.0, "polar_inertia_per_length": 2e-3, "viscous_drag": 0.05,
        "modes": {"y": 2, "z": 2, "twist": 1}, "ends": {"mid": 0.45}, **given,
    }  # fmt: skip
    hub = {"name": "hub", "mass": 2.0, "center_of_mass": [0.02, 0.01, -0.03],
           "inertia": [0.1, 0.2, 0.25, 0.01, 0.0, -0.02],
           "ends": {"out": {"position": [0.1, 0.2, 0.05],
                            "orientation": [0.1, -0.2, 0.3]}}}  # fmt: skip
    bob = {"name": "bob", "mass": 0.2, "center_of_mass": [0.05, 0.02, 0.01], "inertia": [1e-3] * 3}
    hinges = [
        {"name": "base", "type": "ball", "inboard": "ground", "outboard": "hub",
         "initial": {"u": [1.0, 2.0, 0.5]}},
        {"name": "holder", "type": "universal", "inboard": "hub.out", "outboard": "blade",
         "axis": [0, 0, 1], "axis2": [0, 1, 0], "initial": {"q": [0.2, 0.1]}},
        {"name": "wrist", "type": "pin", "inboard": "blade.tip", "outboard": "bob",
         "orientation": [0.2, 0.3, 0.4]},
    ]  # fmt: skip
    loads = [
        {"name": "wind", "on": "blade", "force_per_length": [0.2, "0.5*cos(3*t)", 0.3],
         "span": [0.2, 0.8]},
        {"on": "blade.mid", "force": [0, 0.3, 0], "moment": [0.01, 0.02, 0.03], "axes": "body"},
    ]  # fmt: skip
    spring = {"from": "ground", "to": "blade.tip", "law": {"stiffness": 3.0, "rest": 0.2}}
    return mstmm.Scene(gravity=(1.0, -9.81, 2.0), body=[hub, bob], beam=[blade], hinge=hinges,
                       load=loads, spring=[spring])  # fmt: skip


TIMES = np.linspace(0.0, 0.4, 21)


def run_of(scene: mstmm.Scene) -> Result:
    return mstmm.compile(scene, engine="looped").simulate(0.4, output_times=TIMES)


@pytest.fixture(scope="module")
def run() -> Result:
    return run_of(machine(stiffening=False))


def held_loads(run: Result) -> tuple[Array, Array]:
    """Force and moment on the root from the free side, inertial axes."""
    axes = run.orientation("blade.root")
    w, v = axes[:, :1], axes[:, 1:]

    def rotate_to_inertial(local: Array) -> Array:
        return local + 2 * np.cross(v, np.cross(v, local) + w * local)

    return -rotate_to_inertial(run.section_force("blade", 0.0)), -rotate_to_inertial(
        run.section_moment("blade", "root")
    )


def test_the_free_side_gives_the_load_of_the_hinge_that_holds_the_beam(run: Result) -> None:
    """The sweep brings the same load inwards; in a linear beam nothing is neglected."""
    force, moment = held_loads(run)
    np.testing.assert_allclose(force, run.force("holder"), atol=1e-11)
    np.testing.assert_allclose(moment, run.moment("holder"), atol=1e-11)
    assert np.abs(force).max() > 5.0 and np.abs(moment).max() > 0.05


@pytest.mark.parametrize("end", ["root", "tip"])
def test_a_cantilever_held_by_either_end_has_its_weight_there(end: str) -> None:
    """At a held tip nothing of the beam lies beyond: there it is the hinge that holds."""
    blade = {"name": "blade", "length": 2.0, "mass_per_length": 1.5, "bending_stiffness": 1e5,
             "modes": {"y": 3}, "initial": "static", "stiffening": False}  # fmt: skip
    weld = {"name": "weld", "type": "fixed", "inboard": "ground", "outboard": f"blade.{end}"}
    scene = mstmm.Scene(gravity=[0, -9.81, 0], beam=[blade], hinge=[weld])
    run = mstmm.compile(scene).simulate(0.01, output_times=[0.0])
    weight, at = 9.81 * 3.0, 0.0 if end == "root" else 2.0
    holds = -weight if end == "root" else weight  # of the part beyond on the part before
    for x in (at, end):
        np.testing.assert_allclose(run.section_force("blade", x)[0], [0, holds, 0], atol=1e-2)
        np.testing.assert_allclose(run.section_moment("blade", x)[0, 2], -weight, rtol=1e-4)
    named = run.quantity(f"blade.{end}.section_moment.z").values
    np.testing.assert_allclose(abs(named), abs(run.moment("weld")[:, 2]), rtol=1e-9)


@pytest.mark.parametrize(("table", "tolerance"), [({}, 3e-6), ({"quadrature": True}, 1e-4)])
def test_the_same_with_stiffening_up_to_third_order(
    table: dict[str, Any], tolerance: float
) -> None:
    run = run_of(machine(**table))
    force, moment = held_loads(run)
    np.testing.assert_allclose(force, run.force("holder"), atol=1e-11)
    np.testing.assert_allclose(moment, run.moment("holder"), atol=tolerance)
    assert np.abs(run.force("holder")[:, 0]).max() > 2.0


@pytest.mark.parametrize("table", [{}, {"quadrature": True}, {"frame": "mean"}])
def test_momenta_of_the_bodies_are_those_of_the_scene(table: dict[str, Any]) -> None:
    run = run_of(machine(**table))
    linear = sum(run.body_momentum(body) for body in BODIES)
    np.testing.assert_allclose(linear, run.momentum(), atol=1e-13)
    angular = sum(
        run.body_angular_momentum(body)
        + np.cross(run.center_of_mass(body), run.body_momentum(body))
        for body in BODIES
    )
    np.testing.assert_allclose(angular, run.angular_momentum(), atol=1e-13)


def test_a_rigid_body_moves_as_its_equivalent(run: Result) -> None:
    spin, origin = run.angular_velocity("bob"), run.position("bob")
    np.testing.assert_array_equal(run.equivalent_angular_velocity("bob"), spin)
    arm = run.center_of_mass("bob") - origin
    np.testing.assert_allclose(np.linalg.norm(arm, axis=1), np.sqrt(0.003), rtol=1e-12)
    moved = run.velocity("bob") + np.cross(spin, arm)
    np.testing.assert_allclose(run.equivalent_velocity("bob"), moved, atol=1e-14)
    np.testing.assert_allclose(run.body_momentum("bob"), 0.2 * moved, atol=1e-14)


def test_deflections_agree_with_the_motion_of_the_ends(run: Result) -> None:
    """The end in the floating frame: at rest place and deflection, turned outwards."""
    tip = run.deflected_shape("blade", points=3)[:, -1]
    np.testing.assert_allclose(tip, run.position("blade.tip"), atol=1e-13)
    several = run.deflection("blade", [0.0, 0.45, 1.0])
    assert several.shape == (21, 3, 3)
    places: tuple[Any, ...] = (0.0, "mid", "tip")
    for k, place in enumerate(places):
        np.testing.assert_allclose(several[:, k], run.deflection("blade", place), atol=1e-15)
    assert run.slope("blade", "tip").shape == (21, 2)
    assert run.curvature("blade", np.array([0.1, 0.2])).shape == (21, 2, 2)
    assert run.axial_force("blade", 0.3).shape == (21,)


def test_energies_of_the_modes(run: Result) -> None:
    strain = run.strain_energy("blade")
    springs = run.energy_components()["springs"]
    reach = np.linalg.norm(run.position("blade.tip"), axis=1)
    np.testing.assert_allclose(springs, strain + 1.5 * (reach - 0.2) ** 2, rtol=1e-12)
    assert run.modal_energy("blade").shape == (21, 5)
    assert (run.modal_energy("blade").sum(axis=1) >= strain).all()


def test_free_flight_keeps_the_equivalent_motion() -> None:
    """A thrown, bent beam: V_RB falls with gravity and w_RB stays, whatever the frame."""
    beam = {
        "name": "spear", "length": 2.0, "mass_per_length": 0.5, "bending_stiffness": 150.0,
        "modes": {"y": 4}, "polar_inertia_per_length": 1e-4, "stiffening": False,
    }  # fmt: skip
    hinge = {"name": "hand", "type": "planar", "inboard": "ground", "outboard": "spear",
             "normal": [0, 0, 1], "axis2": [1, 0, 0],
             "initial": {"u": [15.0, 13.0, -0.5]}}  # fmt: skip
    for frame, size in (("mean", 0.03), ("tangent", 0.05)):
        start = {"eta": [size, 0.0, 0.01, 0.0]}
        table = {**beam, "frame": frame, "initial": start}
        scene = mstmm.Scene(gravity=(0, -9.81, 0), beam=[table], hinge=[hinge])
        run = mstmm.compile(scene).simulate(0.5, rtol=1e-11, atol=1e-13)
        velocity, spin = run.equivalent_velocity("spear"), run.equivalent_angular_velocity("spear")
        falling = velocity[0] + np.outer(run.t, [0.0, -9.81, 0.0])
        np.testing.assert_allclose(velocity, falling, atol=1e-9)
        np.testing.assert_allclose(spin, np.tile(spin[0], (len(run.t), 1)), atol=1e-9)
        assert run.strain_energy("spear").max() > 1.0


# --- names and refusals ---------------------------------------------------------------------------


def test_inner_nodes_are_no_bodies_and_no_hinges(run: Result) -> None:
    assert list(run.model.coordinate_layout.hinges) == ["base", "holder", "wrist"]
    references = list(run._observations.references)
    assert references == [
        "hub", "hub.out", "bob", "blade", "blade.root", "blade.tip", "blade.mid"
    ]  # fmt: skip
    assert not any("/" in name for name in run.quantity_names())


def test_quantities_by_name(run: Result) -> None:
    first = run.quantity("blade.y1")
    np.testing.assert_array_equal(first.values, run.coordinates("blade")[:, 0])
    assert first.unit == "m" and run.quantity("blade.twist1").unit == "rad"
    assert run.quantity("blade.y1_rate").unit == "m/s"
    assert run.quantity("blade.y1_acceleration").unit == "m/s2"
    deflection = run.quantity("blade.tip.deflection.y")
    np.testing.assert_array_equal(deflection.values, run.deflection("blade", "tip")[:, 1])
    energies = run.quantity("blade.modal_energy")
    assert energies.labels == ("y1", "y2", "z1", "z2", "twist1") and energies.unit == "J"
    for name in run.quantity_names():
        if "blade" in name or name.startswith("bob"):
            assert len(run.quantity(name).values) == len(run.t), name
    assert np.isfinite(run._observations.part("efforts")).all()


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda r: r.curvature("hub", 0.1), r'"hub": curvature .* flexible .* "blade"'),
        (lambda r: r.deflection("blad", 0.1), r'no such flexible body.*"blade"'),
        (lambda r: r.deflection("blade", 1.2), r"x = 1\.2 m is not on the beam.* 0 to 1 m"),
        (lambda r: r.deflection("blade", "tpi"), 'no end "tpi"; it has'),
        (lambda r: r.bending_moment("blade", 0, source="guess"), '"equilibrium" or "shapes"'),
        (lambda r: r.axial_force("blade", 0, source="shapes"), "no axial modes"),
        (lambda r: r.deflected_shape("blade", points=1), "expected 2 or more"),
        (lambda r: r.body_momentum("blade.tip"), "no such body"),
        (lambda r: r.force("blade"), "give its inboard hinge"),
    ],
)
def test_refusals_name_what_there_is(run: Result, ask: Any, words: str) -> None:
    with pytest.raises(mstmm.SceneError, match=words):
        ask(run)


# --- files ----------------------------------------------------------------------------------------


def test_a_saved_result_gives_deflections_again(run: Result, tmp_path: Path) -> None:
    again = mstmm.load_result(run.save(tmp_path / "run.nc"))
    x = np.linspace(0.0, 1.0, 5)
    np.testing.assert_array_equal(again.deflection("blade", x), run.deflection("blade", x))
    np.testing.assert_allclose(
        again.bending_moment("blade", x), run.bending_moment("blade", x), atol=1e-12
    )
    assert str(again.certificate) == str(run.certificate)


def test_a_file_alone_gives_the_deflection_along_a_beam(tmp_path: Path) -> None:
    """With xarray and nothing of mstmm: modal coordinates by name times the shapes."""
    import xarray

    run = run_of(machine())
    with xarray.open_dataset(run.save(tmp_path / "run.nc"), engine="h5netcdf") as file:
        data = file.load()
    names = [f"blade.{mode}" for mode in data["blade_mode"].values]
    eta = data["q"].sel(coordinate=names).values
    moved = np.einsum("xak,tk->txa", data["blade_phi"].values, eta)
    second = data["blade_second_order"].values
    moved -= np.einsum("xakl,tk,tl->txa", second, eta, eta, optimize=True) / 2
    expected = run.deflection("blade", data["blade_x"].values)
    np.testing.assert_allclose(moved, expected, atol=1e-15)
    assert list(data["flexible"].values) == ["blade"]
    np.testing.assert_array_equal(
        data["modal_energy"].sel(mode="blade.z1").values,
        run.quantity("blade.modal_energy.z1").values,
    )
    velocity = data["flexible_equivalent_velocity"].sel(flexible="blade")
    np.testing.assert_array_equal(velocity.values, run.equivalent_velocity("blade"))


def test_a_table_has_a_column_for_every_mode(run: Result, tmp_path: Path) -> None:
    header = run.save(tmp_path / "run.csv").read_text().splitlines()[0].split(",")
    assert len(header) == len(set(header))
    for column in ("blade.y1 [m]", "blade.twist1_rate [rad/s]", "blade.tip.deflection.z [m]",
                   "blade.modal_energy.z2 [J]", "blade.equivalent_velocity.x [m/s]"):  # fmt: skip
        assert column in header
    text = run.table("blade.tip.deflection.y", "blade.strain_energy", rows=3)
    assert "blade.tip.deflection.y" in text and "[J]" in text


def test_an_elastic_body_has_what_needs_no_axis(tmp_path: Path) -> None:
    bob = {"name": "bob", "mass": 0.1, "inertia": [1e-5] * 3}
    hinges = [
        {"name": "pivot", "type": "pin", "axis": [0, 1, 0], "inboard": "ground",
         "outboard": "bar.root"},
        {"name": "weld", "type": "fixed", "inboard": "bar.tip", "outboard": "bob"},
    ]  # fmt: skip
    box = elastic_bar.table(box=elastic_bar.short(3))
    scene = mstmm.Scene(gravity=(0, 0, -9.81), elastic=[box], body=[bob], hinge=hinges)
    run = mstmm.compile(scene, engine="looped").simulate(0.02, output_times=np.linspace(0, 0.02, 6))
    total = run.body_momentum("bar") + run.body_momentum("bob")
    np.testing.assert_allclose(total, run.momentum(), atol=1e-14)
    np.testing.assert_allclose(
        run.modal_energy("bar").sum(axis=1) >= run.strain_energy("bar"), True
    )
    (bar,) = run.certificate.flexible_bodies
    assert bar.gamma is not None and run.warnings == ()
    assert bar.tail is not None and bar.tail < 1e-3  # its deflection is judged, without an axis too
    assert run.picture_names() == ("shape", "bar.shape", "bar.modal_energy")
    assert len(run.plot("shape").axes) == 2
    again = mstmm.load_result(run.save(tmp_path / "bar.nc"))
    np.testing.assert_array_equal(again.modal_energy("bar"), run.modal_energy("bar"))
    for ask in (run.deflection, run.curvature, run.bending_moment):
        with pytest.raises(mstmm.SceneError, match=r'"bar": \w+ exists along beams only'):
            ask("bar", 0.1)
