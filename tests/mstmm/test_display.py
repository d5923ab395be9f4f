"""What a notebook or a prompt shows of scenes, models, results and certificates."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest

import mstmm
from mstmm.derive.catalogue.registry import builtin_elements
from mstmm.errors import SceneError
from mstmm.runtime.figures import figure_class
from tests.support.paths import ROOT
from tests.support.scenes import view as scenes


def cells(shown: str) -> list[str]:
    """Texts of all cells; the markup must be well formed."""
    return [one.text or "" for one in ElementTree.fromstring(f"<p>{shown}</p>").iter() if one.text]


def test_a_scene() -> None:
    scene = mstmm.Scene(**scenes.SCENE)
    assert repr(scene) == "<Scene: 2 bodies, 3 hinges, 1 beam, 1 spring>"
    assert {"elbow", "ball", "blade.tip", "rod"} <= set(cells(scene._repr_html_()))


def test_a_long_scene_is_cut() -> None:
    rod = {"mass": 1.0, "inertia": [1, 1, 1], "ends": {"tip": [1, 0, 0]}}
    chain = {"name": "rope", "count": 50, "inboard": "ground", "end": "tip", "body": [rod],
             "hinge": [{"type": "pin"}]}  # fmt: skip
    shown = cells(mstmm.Scene(gravity=[0, 0, 0], chain=[chain])._repr_html_())
    assert "and 30 more" in shown
    assert "rope[19].hinge" in shown
    assert "rope[20].hinge" not in shown


def test_a_model_and_a_result() -> None:
    model, run = scenes.model(), scenes.run()
    assert repr(model).startswith("<Model: 2 bodies, 3 hinges, 1 beam, 1 spring, 7 degrees of")
    assert "degrees of freedom" in cells(model._repr_html_())
    shown = cells(run._repr_html_())
    assert "201, t = 0 to 2 s" in shown
    assert str(run.certificate.verdict()) in shown
    assert set(cells(run.certificate._repr_html_())) <= set(shown)


def element(name: str) -> Any:
    return next(one for one in builtin_elements() if one.name == name)


#: What shows itself, and the formats that it has.
DISPLAYED: dict[str, tuple[Callable[[], Any], set[str]]] = {
    "scene": (lambda: mstmm.Scene(**scenes.SCENE), {"text/html"}),
    "model": (scenes.model, {"text/html"}),
    "result": (scenes.run, {"text/html"}),
    "certificate": (lambda: scenes.run().certificate, {"text/html"}),
    "view": (lambda: scenes.run().view(), {"text/html"}),
    "equations": (lambda: mstmm.equations("spring"), {"text/html", "text/latex"}),
    "hinge": (lambda: element("prismatic"), {"text/html", "text/latex"}),
    "force": (lambda: element("spring"), {"text/html", "text/latex"}),
}  # fmt: skip


@pytest.mark.parametrize("name", DISPLAYED)
def test_everything_is_one_bundle_of_its_formats(name: str) -> None:
    """As notebooks ask for it, which then ask no other method."""
    make, formats = DISPLAYED[name]
    shown = make()._repr_mimebundle_(include=None, exclude=None)
    assert set(shown) == {"text/plain", *formats}
    assert all(isinstance(one, str) and one for one in shown.values())
    assert shown["text/html"].startswith("<")
    assert " object at 0x" not in shown["text/plain"]
    only = make()._repr_mimebundle_(include=["text/plain", "text/html"], exclude=["text/html"])
    assert only == {"text/plain": shown["text/plain"]}


def test_bundles_say_what_the_pages_say() -> None:
    certificate = scenes.run().certificate
    assert certificate._repr_mimebundle_()["text/plain"] == certificate.as_text()
    spring = mstmm.equations("spring")
    shown = element("spring")._repr_mimebundle_()
    assert shown["text/plain"] == "<Spring: spring-damper-actuator>"
    assert shown["text/latex"] == spring.latex == spring._repr_mimebundle_()["text/latex"]
    assert shown["text/html"] == spring._repr_html_()
    assert spring._repr_mimebundle_()["text/plain"] == spring.text


def test_a_view_shows_itself() -> None:
    shown = scenes.run().view(speed=20.0)._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    assert shown.count('"') == 4  # everything of the page within is escaped


def test_the_package_shows_its_public_names() -> None:
    assert dir(mstmm) == sorted(mstmm.__all__)
    assert all(hasattr(mstmm, name) for name in dir(mstmm))


def test_compile_takes_the_path_of_a_scene(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(mstmm.Scene(**scenes.SCENE).to_toml())
    for given in (path, str(path)):
        assert mstmm.compile(given, engine="looped").scene == mstmm.Scene(**scenes.SCENE)
    with pytest.raises(SceneError, match="there is no such file"):
        mstmm.compile(str(tmp_path / "leg.toml"))
    with pytest.raises(SceneError, match="expected a Scene, or the path of a scene file"):
        mstmm.compile(3)  # type: ignore[arg-type]


NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def test_notebooks_of_the_pages_are_kept_without_what_they_gave() -> None:
    """They are executed where the pages are built."""
    listed = (NOTEBOOKS[0].parent / "index.md").read_text()
    for path in NOTEBOOKS:
        cells = json.loads(path.read_text())["cells"]
        assert f"({path.name})" in listed
        assert not [cell for cell in cells if cell.get("outputs") or cell.get("execution_count")]
        for cell in cells:
            if cell["cell_type"] == "code":
                compile("".join(cell["source"]), path.name, "exec")


def test_figures_show_themselves_where_a_notebook_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for IPython, which keeps what it is told of kinds of objects."""
    printers: dict[type, Callable[[Any], bytes]] = {}
    png = SimpleNamespace(type_printers=printers, for_type=printers.__setitem__)
    shell = SimpleNamespace(
        kernel=object(), display_formatter=SimpleNamespace(formatters={"image/png": png})
    )
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    figure_class()
    monkeypatch.undo()
    figure = scenes.run().plot("energy")
    assert printers[type(figure)](figure)[:4] == b"\x89PNG"
