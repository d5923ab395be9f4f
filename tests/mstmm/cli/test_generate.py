"""Elements of a user's own on the command line: check, generate, list, show, simulate."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.commands import PENDULUM, Command

KNEE = """\
import sympy as sp
from mstmm.derive import Hinge, Param, rotation_about


class Knee(Hinge):
    name = "knee"
    title = "knee on a parabola"
    coordinates = (Param("angle", "rad", "flexion"),)
    parameters = (Param("radius", "m", "radius of rolling", 0.05, 0.001, 1.0),)

    def rotation(self, q, p):
        return rotation_about(2, q.angle)

    def position(self, q, p):
        return sp.Matrix([p.radius * q.angle, p.radius * q.angle**2 / 2, 0])
"""
SCENE = PENDULUM.replace('type = "pin"', 'type = "knee"\nparameters = { radius = 0.05 }')


@pytest.fixture
def knee(folder: Path) -> Path:
    (folder / "leg.toml").write_text(SCENE)
    path = folder / "my_knee.py"
    path.write_text(KNEE)
    return path


def test_the_whole_way(mstmm: Command, knee: Path) -> None:
    unknown = mstmm("check", "leg.toml")
    assert unknown.code == 2 and 'unknown hinge type "knee"' in unknown.err
    checked = mstmm("check", "my_knee.py")
    assert checked.code == 0 and "hinge knee: agrees" in checked.out
    generated = mstmm("generate", "my_knee.py")
    assert generated.code == 0 and "knee" in generated.out
    assert mstmm("check", "leg.toml", "knee").code == 0
    listed = json.loads(mstmm("list", "user", "--json").out)["user"]
    assert [(e["kind"], e["name"], e["parameters"]) for e in listed] == [
        ("hinge", "knee", ["radius [m]"])
    ]
    assert "knee" in mstmm("show", "knee", "--at", "c").out
    assert "flexion" not in mstmm("show", "my_knee.py", "--at", "equations").err
    assert mstmm("simulate", "leg.toml", "--t-end", "0.5").code == 0


def test_hinge_option_replaces_generate(mstmm: Command, knee: Path) -> None:
    done = mstmm("simulate", "leg.toml", "--hinge", "my_knee.py", "--t-end", "0.5", "--json")
    assert done.code == 0 and list(json.loads(done.out)["q"]) == ["pivot.angle"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("rotation_about(2, q.angle)", "2 * rotation_about(2, q.angle)", "not a rotation"),
        ("rotation_about(2, q.angle)", "sp.eye(2)", "rotation"),
        ("rotation_about(2, q.angle)", "undefined_name", "undefined_name"),
        ('"rad", "flexion"', '"furlong", "flexion"', "furlong"),
        ("p.radius * q.angle,", "p.radius**2 * q.angle,", "m"),
        ('name = "knee"', 'name = "pin"', "built in"),
        ('name = "knee"', 'name = "not a name"', "name"),
        ("import sympy as sp", "import sympy as sp\n1 / 0", "ZeroDivisionError"),
        ("import sympy as sp", "import sympy as sp\nraise SystemExit(0)", "SystemExit"),
        ("import sympy as sp", "import no_such_package", "no_such_package"),
        ("class Knee(Hinge):", "class Knee(Hinge:", "SyntaxError"),
    ],
)
def test_wrong_definition(mstmm: Command, knee: Path, old: str, new: str, said: str) -> None:
    assert old in KNEE
    knee.write_text(KNEE.replace(old, new))
    for command in ("check", "generate"):
        done = mstmm(command, "my_knee.py")
        if (command, said) == ("check", "built in"):
            continue
        assert done.code == 2 and said in done.err, done
        assert "Traceback" not in done.err
    assert json.loads(mstmm("list", "user", "--json").out)["user"] == []


@pytest.mark.parametrize("name", ["none.py", "folder.py", "pendulum.toml", "", "\0.py"])
def test_no_python_file(mstmm: Command, folder: Path, name: str) -> None:
    (folder / "folder.py").mkdir()
    done = mstmm("generate", name)
    assert done.code == 2 and "Python file" in done.err


def test_store_that_cannot_be_written(
    mstmm: Command, knee: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MSTMM_KERNELS", "/proc/kernels")
    done = mstmm("generate", "my_knee.py")
    assert done.code == 3 and "/proc/kernels" in done.err


def test_check_and_file_do_not_mix(mstmm: Command, knee: Path) -> None:
    done = mstmm("generate", "--check", "my_knee.py")
    assert done.code == 2 and "mstmm check FILE" in done.err


def test_generated_folder_that_is_out_of_date(
    mstmm: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    differences = "mstmm.derive.catalogue.element_specs.differences"
    monkeypatch.setattr(differences, lambda folder: ["--- committed/x"])
    done = mstmm("generate", "--check")
    assert done.code == 2 and "mstmm generate" in done.err and "committed/x" in done.out
    monkeypatch.setattr(differences, lambda folder: [])
    assert mstmm("generate", "--check").code == 0


def test_no_checkout_no_regeneration(
    mstmm: Command, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mstmm.cli.generate._generated_folder", lambda: folder / "generated")
    done = mstmm("generate")
    assert done.code == 3 and "clone" in done.err


def test_an_element_of_the_store_shows_its_equations(mstmm: Command, knee: Path) -> None:
    assert mstmm("generate", "my_knee.py").code == 0
    by_file, by_name = mstmm("show", "my_knee.py"), mstmm("show", "knee")
    assert (
        by_name.code == 0 and by_name.out == by_file.out and "position of P from Q" in by_name.out
    )
    beside = mstmm("show", "knee", "--beside")
    assert beside.code == 2 and "hinge_knee: no classical matrix exists" in beside.err


@pytest.mark.parametrize("format", ["text", "latex", "html"])
def test_sources_of_the_sweep_are_not_those_of_an_element(
    mstmm: Command, knee: Path, format: str
) -> None:
    """The knee states no source: what is cited of Rui et al. is said to be the sweep's."""
    mstmm("generate", "my_knee.py")
    for element in ("my_knee.py", "knee"):
        for at in ("equations", "matrix", "ir"):
            lines = mstmm("show", element, "--at", at, "--format", format).out.splitlines()
            cited = [line for line in lines if "Multibody Syst. Dyn." in line]
            assert cited
            assert all("ource of the sweep: " in line for line in cited)
            assert not any(line.startswith("source: ") or "Source: " in line for line in lines)
    own = [line for line in mstmm("show", "pin").out.splitlines() if line.startswith("source: ")]
    assert own == ["source: Rui, Wang, Zhang, ch. 5, (5.50)-(5.54)"]
