"""Rows that repeat others, and what a model tells of its loops."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from mstmm.runtime.engine.loops.loop_analysis import LoopAnalysis
from tests.support.scenes.linkages import bricard, cranks
from tests.support.scenes.published_mechanisms import Scene, four_bars, rod, scissors
from tests.system.loops.test_four_bar import linkage

#: A rotation that leaves no axis along a coordinate.
SKEW = [0.31, -0.62, 0.44]


def oblique(scene: Scene) -> Scene:
    """A planar mechanism on the ground in an oblique plane."""
    matrix = _rotation(*SKEW)
    for hinge in scene["hinge"]:
        if hinge["inboard"] == "ground":
            hinge["orientation"] = SKEW
            hinge["position"] = [float(x) for x in matrix @ hinge.get("position", [0, 0, 0])]
    scene["gravity"] = [float(x) for x in matrix @ scene["gravity"]]
    return scene


def _rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    cx, cy, cz = np.cos([roll, pitch, yaw])
    sx, sy, sz = np.sin([roll, pitch, yaw])
    x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return z @ y @ x


def loops_of(scene: Scene) -> LoopAnalysis:
    return mstmm.compile(mstmm.Scene(**scene)).loops


@pytest.mark.parametrize(("count", "rows"), [(1, 5), (5, 25)])
def test_pins_of_a_plane_in_space(count: int, rows: int) -> None:
    """Of five rows a pin of a planar loop has two of its own, in any plane."""
    for scene in (four_bars(count, 1.1), oblique(four_bars(count, 1.1))):
        loops = loops_of(scene)
        assert len(loops.constraint_rows) == rows
        assert loops.rank == 2 * count
        assert len(loops.redundant_rows) == 3 * count
        assert {word for _, word in loops.redundant_rows} == {"z", "mx", "my"}
        assert loops.mobility == 1 and not loops.singular and loops.max_open_rows <= 4
        assert len(loops.indeterminate_reactions) == 3 * count + 1
        assert set(loops.indeterminate_reactions.values()) == {("fz", "mx", "my")}


def test_an_oblique_plane_changes_no_motion() -> None:
    found = []
    for scene in (linkage("closing_pin"), oblique(linkage("closing_pin"))):
        model = mstmm.compile(mstmm.Scene(**scene))
        found.append(model.accelerations(*model.initial_state()))
    assert np.abs(found[0] - found[1]).max() < 1e-11


def test_a_ball_cut_leaves_one_row_too_many() -> None:
    scene = linkage(None, laws=False)
    scene["hinge"][3]["type"] = "ball"
    scene["hinge"][3].pop("initial")
    loops = loops_of(scene)
    assert (len(loops.constraint_rows), loops.rank) == (3, 2)
    assert loops.redundant_rows == (("closing_pin", "z"),)
    # One state: a force across the plane at the ball, which the bars carry to the ground.
    assert loops.indeterminate_reactions == {
        "crank_pin": ("fz", "mx", "my"), "coupler_pin": ("fz", "my"), "rocker_pin": ("fz", "my"),
        "closing_pin": ("fz",),
    }  # fmt: skip


def test_a_third_crank_repeats_a_row_of_its_own() -> None:
    """Redundant across loops alone: each loop has two rows that count, together three."""
    scene = four_bars(1, 1.1)
    scene["body"].append(rod("third"))
    scene["body"][2]["ends"]["middle"] = [0.5, 0, 0]
    scene["hinge"] += [
        {"name": "foot", "type": "pin", "inboard": "ground", "outboard": "third",
         "position": [0.5, 0, 0], "initial": {"q": 1.1, "u": -1.0}},
        {"name": "top", "type": "pin", "inboard": "coupler0.middle", "outboard": "third.tip",
         "initial": {"q": 1.1, "u": -1.0}},
    ]  # fmt: skip
    loops = loops_of(scene)
    assert (len(loops.constraint_rows), loops.rank, loops.mobility) == (10, 3, 1)
    assert not loops.singular
    # Along its own crank, besides what the plane leaves open.
    assert (
        loops.indeterminate_reactions["foot"]
        == loops.indeterminate_reactions["foot0"]
        == ("fx", "fz", "mx", "my")
    )


@pytest.mark.parametrize(("tilt", "told"), [(1e-7, False), (1e-5, True), (9e-4, True)])
def test_rows_that_nearly_repeat_others_are_told(tilt: float, told: bool) -> None:
    """A pin of a planar four-bar out of the normal of the plane by an angle in rad."""
    scene = linkage("closing_pin", laws=False)
    scene["hinge"][2]["axis"] = [np.sin(tilt), 0.0, np.cos(tilt)]
    model = mstmm.compile(mstmm.Scene(**scene))
    gap, name, direction = model.loops.redundancy_gap
    assert gap == pytest.approx(tilt * told, rel=0.2)
    assert (name, direction) == (("closing_pin", "mx") if told else ("", ""))
    result = model.simulate(0.01)
    assert [risk.name for risk in result.risks] == ["nearly-redundant"] * told
    assert all(
        "closing_pin" in risk.element and f"{gap:.1e}" in risk.description for risk in result.risks
    )


def test_loads_of_couplings_that_repeat_each_other_are_open() -> None:
    hinges = [
        {"name": name, "type": "pin", "inboard": "ground", "outboard": body}
        for name, body in (("left", "a"), ("right", "b"), ("alone", "c"))
    ]
    couplings = [
        {"name": "gear", "expression": "left.q + 3*right.q"},
        {"name": "again", "expression": "2*left.q + 6*right.q"},
        {"name": "other", "expression": "left.q - alone.q"},
    ]
    bodies = [rod(name) for name in "abc"]
    scene = {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges, "coupling": couplings}
    loops = loops_of(scene)
    assert loops.redundant_rows == (("again", "expression"),) and not loops.redundant_in_this_pose
    assert loops.indeterminate_reactions == {"gear": ("expression",), "again": ("expression",)}


def test_loads_of_constraints_that_repeat_each_other_are_open() -> None:
    """Two rods on pins, side by side, their tips and middles at the distance of their feet."""
    rods = [rod(name) | {"ends": {"tip": [1, 0, 0], "middle": [0.5, 0, 0]}} for name in "ab"]
    hinges = [
        {"name": f"foot_{name}", "type": "pin", "inboard": "ground", "outboard": name,
         "position": [float(k), 0, 0], "initial": {"q": 1.0}}
        for k, name in enumerate("ab")
    ]  # fmt: skip
    distances = [
        {
            "name": f"to_{end}",
            "type": "distance",
            "from": f"a.{end}",
            "to": f"b.{end}",
            "length": 1.0,
        }
        for end in ("tip", "middle")
    ]
    scene = {"gravity": [0, -9.81, 0], "body": rods, "hinge": hinges, "constraint": distances}
    loops = loops_of(scene)
    assert (loops.rank, loops.mobility) == (1, 1)
    assert (
        loops.indeterminate_reactions["to_tip"]
        == loops.indeterminate_reactions["to_middle"]
        == ("length",)
    )
    assert set(loops.indeterminate_reactions) == {"foot_a", "foot_b", "to_tip", "to_middle"}


def test_a_certificate_tells_rows_and_loads() -> None:
    model = mstmm.compile(mstmm.Scene(**linkage("closing_pin", laws=False)))
    told = str(model.simulate(0.01).certificate.loop_closure)
    assert "2 of 5 rows independent, mobility 1; redundant rows: z of closing_pin, mx" in told
    assert "indeterminate loads: fz mx my of crank_pin" in told


@pytest.mark.parametrize("count", [1, 2, 6])
def test_flat_windows_are_a_singular_start(count: int) -> None:
    """Flat on the ground a row of each loop says nothing; a little way off it does, so it stays."""
    model = mstmm.compile(mstmm.Scene(**four_bars(count, 0.0)))
    assert model.loops.singular
    assert (model.loops.rank, model.loops.generic_rank) == (count, 2 * count)
    assert model.loops.redundant_in_this_pose == tuple((f"right{k}", "x") for k in range(count))
    assert set(model.loops.redundant_in_this_pose) < set(model.loops.redundant_rows)
    assert int(model.packed_scene.model.n_rows) == 2 * count
    assert set(model.loops.indeterminate_reactions.values()) == {("fz", "mx", "my")}
    result = model.simulate(0.5, rtol=1e-8)
    assert result.success, result.message


def test_many_flat_windows_leave_the_same_open() -> None:
    """Off the pose a pin of a plane bears every load in it, however many windows there are."""
    loops = loops_of(four_bars(12, 0.0))
    assert (loops.rank, loops.generic_rank) == (12, 24)
    assert set(loops.indeterminate_reactions.values()) == {("fz", "mx", "my")}


@pytest.mark.parametrize("angle", [0.0, np.pi])
@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_cranks_side_by_side_begin_flat(count: int, angle: float) -> None:
    """With one freedom left off the pose, `count` + 1 coordinates of the tree take `count` rows."""
    loops = loops_of(cranks(angle=angle, places=np.linspace(0.0, 1.5, count).tolist()))
    assert (loops.rank, loops.generic_rank) == (count - 1, count)
    assert len(loops.redundant_in_this_pose) == 1


def test_cranks_that_begin_flat_go_on_as_one() -> None:
    """All turn alike, and energy is kept; a row too many had let it stick, 1.2 J off."""
    scene = cranks(angle=0.0, places=np.linspace(0.0, 1.5, 4).tolist())
    for hinge in scene["hinge"]:
        hinge["initial"]["u"] = 2.0 if hinge["name"].startswith("foot") else -2.0
    result = mstmm.compile(mstmm.Scene(**scene)).simulate(3.0, rtol=1e-9)
    assert result.success, result.message
    assert result.statistics is not None and result.statistics.evaluations < 5000
    assert np.ptp(result.q[:, :4], axis=1).max() < 1e-11
    assert np.ptp(result.energy()) < 1e-6


def test_masses_do_not_decide() -> None:
    for mass in (1e-4, 1e6):
        scene = linkage("closing_pin", laws=False)
        scene["body"][1]["mass"] = mass
        scene["body"][1]["inertia"] = [0.0, mass / 10, mass / 10]
        assert loops_of(scene).rank == 2


def test_what_hangs_on_a_loop_does_not_decide() -> None:
    """The loops at the foot of a scissor mast carry all that is above them."""
    loops = loops_of(scissors(120))
    assert (len(loops.constraint_rows), loops.rank, loops.mobility) == (600, 240, 1)
    assert not loops.singular and loops.max_open_rows <= 4


def test_an_axis_a_little_off_does_not_lock() -> None:
    """Tilted by 1e-4 rad the pin still repeats what the others do."""
    scene = linkage("closing_pin", laws=False)
    scene["hinge"][3]["orientation"] = [1e-4, 0.0, 0.0]
    loops = loops_of(scene)
    assert (loops.rank, loops.mobility) == (2, 1)


def test_rows_are_called_by_axes_of_their_own() -> None:
    """Five directions of a pin along no axis have five names; its load is open but about it."""
    loops = loops_of(bricard())
    assert (loops.rank, len(set(loops.constraint_rows))) == (4, 5)
    about = {"pin0": "my", "pin1": "mz", "pin2": "mx", "pin3": "my", "pin4": "mz", "pin5": "mx"}
    for name, words in loops.indeterminate_reactions.items():
        assert len(words) == 5 and about[name] not in words


def test_a_tree_closes_nothing() -> None:
    scene = linkage(None, laws=False)
    del scene["hinge"][3]
    assert loops_of(scene) == LoopAnalysis()
