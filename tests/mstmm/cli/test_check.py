"""`mstmm check` of scenes, and what cannot be checked."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import mstmm as package
from tests.support.commands import PENDULUM, Command


def test_scene_is_summed_up(mstmm: Command) -> None:
    done = mstmm("check", "pendulum.toml")
    assert done.code == 0 and done.err == ""
    assert "pendulum.toml: ok; 1 body, 1 hinge, 1 coordinate, 1 speed" in done.out
    assert "rod  (pivot: pin)" in done.out


def test_a_chain_is_one_line(mstmm: Command, folder: Path) -> None:
    (folder / "rope.toml").write_text(
        """
        gravity = [0, 0, -9.81]
        body = [{ name = "weight", mass = 2.0, inertia = [1, 1, 1] }]
        hinge = [{ name = "hook", type = "pin", inboard = "rope[last].tip", outboard = "weight" }]
        [[chain]]
        name = "rope"
        count = 1000
        inboard = "ground"
        body = { mass = 0.1, inertia = [1, 1, 1], ends = { tip = [0.1, 0, 0] } }
        hinge = { type = "ball" }
        """
    )
    done = mstmm("check", "rope.toml")
    assert "1001 bodies, 1001 hinges, 4001 coordinates, 3001 speeds" in done.out
    assert "    rope[0] to rope[999]  (ball)\n" in done.out and "weight  (hook: pin)" in done.out
    done = mstmm("simulate", "rope.toml", "--t-end", "0.001", "--no-certify")
    assert done.code == 0 and "1001 bodies on 1001 hinges, 3001 degrees of freedom" in done.out


def test_flexible_bodies_and_what_was_chosen_for_them(mstmm: Command, folder: Path) -> None:
    (folder / "blade.toml").write_text(
        """
        gravity = [0, 0, -9.81]
        body = [{ name = "camera", mass = 0.3, inertia = [1, 1, 1] }]
        hinge = [
            { name = "hub", type = "pin", inboard = "ground", outboard = "blade" },
            { name = "mount", type = "fixed", inboard = "blade.tip", outboard = "camera" },
        ]
        [[beam]]
        name = "blade"
        length = 10.0
        mass_per_length = 1.2
        bending_stiffness = 1.4e4
        rotary_inertia = 0.3
        modes = { y = 2 }
        """
    )
    done = mstmm("check", "blade.toml")
    assert done.code == 0
    assert "ok; 1 body, 1 beam, 2 hinges, 3 coordinates, 3 speeds" in done.out
    assert 'note: beam "blade": its length is 5.8 times the height of the section' in done.out
    assert "  blade: y: 2 " in done.out
    assert "    blade  (hub: pin)\n      camera  (mount: fixed)\n" in done.out


def test_echo_loads_back_to_the_same_scene(mstmm: Command, folder: Path) -> None:
    done = mstmm("check", "pendulum.toml", "--echo")
    (folder / "echo.toml").write_text(done.out)
    echoed = package.load_scene(folder / "echo.toml")
    assert echoed == package.load_scene(folder / "pendulum.toml")


def test_starts_of_loops_are_written_as_they_close(mstmm: Command, folder: Path) -> None:
    """Two equal cranks side by side: the bar between them lies flat, whatever was wished."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    pins = [("ground", "left", 0.7), ("left.tip", "bar", -0.4), ("ground", "right", 0.6),
            ("bar.tip", "right.tip", 0.8)]  # fmt: skip
    hinges = [
        {"name": f"pin{k}", "type": "pin", "inboard": inboard, "outboard": outboard,
         "initial": {"q": q}, "hold": k == 0, "cut": k == 3}
        for k, (inboard, outboard, q) in enumerate(pins)
    ]  # fmt: skip
    hinges[2]["position"] = [1, 0, 0]
    bodies = [rod | {"name": name} for name in ("left", "bar", "right")]
    scene = package.Scene(gravity=[0, -9.81, 0], body=bodies, hinge=hinges)
    (folder / "cranks.toml").write_text(scene.to_toml())
    done = mstmm("check", "cranks.toml", "--assembled")
    (folder / "closed.toml").write_text(done.out)
    for hinge, wanted in zip(
        package.load_scene(folder / "closed.toml").hinge, (0.7, -0.7, 0.7, 0.7), strict=True
    ):
        assert hinge.initial is not None and hinge.initial.q is not None
        assert abs(hinge.initial.q[0] - wanted) < 1e-9
    assert mstmm("check", "closed.toml", "--assembled").code == 0


def test_json_tells_what_loops_leave_free(mstmm: Command, folder: Path) -> None:
    """Three equal cranks that carry one bar in a plane: two would do."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1],
           "ends": {"tip": [1, 0, 0], "middle": [0.5, 0, 0]}}  # fmt: skip
    bodies = [rod | {"name": name} for name in ("a", "b", "c", "bar")]
    hinges: list[dict[str, object]] = [
        {"name": f"foot_{name}", "type": "pin", "inboard": "ground", "outboard": name,
         "position": [place, 0, 0], "initial": {"q": 0.8}}
        for name, place in (("a", 0.0), ("b", 0.5), ("c", 1.0))
    ]  # fmt: skip
    hinges += [
        {"name": f"top_{name}", "type": "pin", "inboard": f"{name}.tip", "outboard": end,
         "initial": {"q": -0.8}, "cut": name != "a"}
        for name, end in (("a", "bar"), ("b", "bar.middle"), ("c", "bar.tip"))
    ]  # fmt: skip
    scene = package.Scene(gravity=[0, -9.81, 0], body=bodies, hinge=hinges)
    (folder / "cranks.toml").write_text(scene.to_toml())
    reports = json.loads(mstmm("check", "cranks.toml", "pendulum.toml", "--json").out)["checked"]
    told, loops = reports[0]["loops"], package.compile(scene).loops
    assert reports[1]["loops"] is None
    assert (told["rows"], told["rank"], told["mobility"], told["nearby"]) == (10, 3, 1, 3)
    assert told["cut"] == ["top_b", "top_c"] and not told["singular"] and told["misfit"] is None
    assert [(one["of"], one["direction"]) for one in told["dropped"]] == list(loops.redundant_rows)
    assert not any(one["momentary"] for one in told["dropped"]) and len(told["dropped"]) == 7
    assert not told["reactions_unique"]
    assert {
        of: tuple(words) for of, words in told["not_unique"].items()
    } == loops.indeterminate_reactions


def test_every_file_is_looked_at(mstmm: Command, folder: Path) -> None:
    (folder / "bad.toml").write_text("gravity = 3\n")
    done = mstmm("check", "bad.toml", "pendulum.toml", "none.toml", "--json")
    data = json.loads(done.out)
    assert done.code == 2 and not data["ok"]
    assert [report["ok"] for report in data["checked"]] == [False, True, False]
    assert "gravity" in data["checked"][0]["message"]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.toml", b""),
        ("binary.toml", bytes(range(256))),
        ("latin.toml", "gravity = [0, 0, 0] # é".encode("latin-1")),
        ("list.json", b"[1, 2]"),
        ("deep.json", b"[" * 100000),
        ("code.toml", b"gravity = __import__('os').system('touch hacked')"),
    ],
)
def test_file_that_is_no_scene(mstmm: Command, folder: Path, name: str, content: bytes) -> None:
    (folder / name).write_bytes(content)
    for command in ("check", "simulate"):
        done = mstmm(command, name)
        assert done.code == 2 and name in done.err and done.out == ""
    assert not (folder / "hacked").exists()


@pytest.mark.parametrize(
    "name", ["", " ", ".", "..", "/", "a/b", "x.yaml", "-", "\0", "\udcff.toml"]
)
def test_name_that_is_nothing(mstmm: Command, name: str) -> None:
    done = mstmm("check", "--", name)
    assert done.code == 2 and done.err.startswith("mstmm: ")


def test_folder_is_no_scene(mstmm: Command, folder: Path) -> None:
    (folder / "scene.toml").mkdir()
    done = mstmm("check", "scene.toml")
    assert done.code == 2 and "folder" in done.err


def test_names_with_control_characters_are_shown_harmlessly(mstmm: Command) -> None:
    done = mstmm("check", "\x1b[31mred\x07.toml")
    assert done.code == 2 and "\x1b" not in done.err and "\x07" not in done.err


def test_names_beyond_ascii_work(mstmm: Command, folder: Path) -> None:
    (folder / "Päpendel 振り子.toml").write_text((folder / "pendulum.toml").read_text())
    assert mstmm("check", "Päpendel 振り子.toml").code == 0
    done = mstmm("simulate", "Päpendel 振り子.toml", "--t-end", "0.1")
    assert done.code == 0 and (folder / "Päpendel 振り子.nc").is_file()


def test_the_fastest_motion_is_named_with_its_element(mstmm: Command, folder: Path) -> None:
    """A damper between a rod on a pin and a tool at its tip: c (1/I_tool + 1/I_rod)."""
    tool = """
[[body]]
name = "tool"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
[[hinge]]
name = "grip"
type = "pin"
inboard = "rod.tip"
outboard = "tool"
law = { damping = 1e6 }
"""
    (folder / "stiff.toml").write_text(PENDULUM + tool)
    done = mstmm("check", "stiff.toml")
    assert 'fastest motion at the start: 1.07e+07 1/s, by hinge "grip"' in done.out
    assert "--method auto" in done.out
    data = json.loads(mstmm("check", "stiff.toml", "--json").out)["checked"][0]["fastest"]
    assert data["element"] == 'hinge "grip"'
    assert data["rate"] == pytest.approx(1e6 * (1 / 0.1 + 1 / (0.084 + 0.25 + 1.0)), rel=1e-4)
    slow = mstmm("check", "pendulum.toml").out
    assert "fastest motion" in slow and "--method auto" not in slow
