"""Elements that installed packages publish as entry points of the group mstmm.elements."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import mstmm
from mstmm.cli.app import app
from mstmm.derive.catalogue.registry import installed_elements
from mstmm.pipeline.compilation import generate_published

MODULE = """
import sympy as sp
from mstmm.derive import Hinge, Param, rotation_about

class Helix(Hinge):
    name = "helix"
    coordinates = (Param("turn", "rad"),)
    def rotation(self, q, p):
        return rotation_about(2, q.turn)

class Tilt(Helix):
    name = "tilt"
    def rotation(self, q, p):
        return rotation_about(0, q.turn)
"""


def publish(folder: Path, entries: str, module: str = MODULE) -> None:
    """A distribution as pip leaves it: a module and its metadata."""
    (folder / "acme_hinges.py").write_text(module)
    info = folder / "acme_hinges-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: acme-hinges\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(f"[mstmm.elements]\n{entries}\n")


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "kernels"))
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    monkeypatch.delitem(__import__("sys").modules, "acme_hinges", raising=False)
    return folder


def test_published_elements_are_listed_and_generated(site: Path) -> None:
    assert installed_elements() == []
    publish(site, "helix = acme_hinges:Helix")
    ((package, elements),) = installed_elements()
    assert (package, [e.name for e in elements]) == ("acme-hinges", ["helix"])
    listed = CliRunner().invoke(app, ["list", "installed", "--json"])
    assert listed.exit_code == 0
    entry = {"name": "helix", "package": "acme-hinges", "where": "acme_hinges:Helix"}
    assert json.loads(listed.stdout)["installed"] == [entry]
    made = CliRunner().invoke(app, ["generate", "--installed", "--json"])
    assert made.exit_code == 0
    assert [e["name"] for e in json.loads(made.stdout)["generated"]] == ["helix"]
    joint = {"name": "j", "type": "helix", "inboard": "ground", "outboard": "rod"}
    rod = {"name": "rod", "mass": 1, "center_of_mass": [1, 0, 0], "inertia": [1, 1, 1]}
    model = mstmm.compile(mstmm.Scene(gravity=[0, -10, 0], body=[rod], hinge=[joint]))
    assert model.accelerations([0.0], [0.0]) == pytest.approx([-5.0])


def test_a_whole_module_is_published(site: Path) -> None:
    publish(site, "all = acme_hinges")
    assert [made.spec.name for made in generate_published()] == ["helix", "tilt"]


@pytest.mark.parametrize(
    ("entries", "module", "message"),
    [
        ("helix = acme_hinges:Helixx", MODULE, "acme-hinges: entry point helix = .*AttributeError"),
        (
            "helix = acme_hinges:Param",
            MODULE,
            "acme-hinges: .*expected a subclass of mstmm.derive.Hinge",
        ),
        ("helix = acme_hinges", "import nothing_there", "acme-hinges: .*ModuleNotFoundError"),
        ("a = acme_hinges\nb = acme_hinges:Tilt", MODULE, "hinge 'tilt' twice"),
    ],
)
def test_wrong_packages_are_named(entries: str, module: str, message: str, site: Path) -> None:
    publish(site, entries, module)
    with pytest.raises(mstmm.ElementError, match=message):
        generate_published()


def test_installed_goes_alone() -> None:
    done = CliRunner().invoke(app, ["generate", "--installed", "--check"])
    assert done.exit_code != 0
