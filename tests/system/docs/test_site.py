"""What the pages are built from is whole: drawings, the reference, the gallery, links."""

from __future__ import annotations

import importlib.util
import re
import sys
from types import ModuleType

import pytest

import mstmm
import mstmm.derive
from tests.support.pages import page_text
from tests.support.paths import ROOT


def module(path: str) -> ModuleType:
    """A file that is part of no package."""
    name = f"site_{path.rpartition('/')[2].removesuffix('.py')}"
    spec = importlib.util.spec_from_file_location(name, ROOT / path)
    assert spec is not None and spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_drawings_are_what_their_script_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = ROOT / "docs/drawings"
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.delitem(sys.modules, "svg_drawing", raising=False)
    drawings = module("docs/drawings/draw.py").DRAWINGS
    assert {path.stem for path in folder.glob("*.svg")} == set(drawings)
    for name, drawing in drawings.items():
        assert (folder / f"{name}.svg").read_text("utf-8") == drawing(), name


def test_the_reference_names_what_is_public() -> None:
    pages = (ROOT / "docs/reference/api").glob("*.md")
    text = "\n".join(path.read_text("utf-8") for path in pages)
    described = set(re.findall(r"^\.\. (?:auto\w+|member-groups):: (\S+)$", text, re.M))
    wanted = {f"mstmm.{name}" for name in mstmm.__all__}
    wanted |= {f"mstmm.derive.{name}" for name in mstmm.derive.__all__}
    assert sorted(wanted - described) == []


def test_the_gallery_has_a_picture_of_each_that_moves() -> None:
    shown = re.findall(r"^```\{moving\} (\w+)$", page_text("docs/gallery.md"), re.M)
    pictures = {path.stem for path in (ROOT / "docs/images/gallery").glob("*.png")}
    assert pictures == set(shown)
    assert all((ROOT / "examples" / name / "scene.toml").is_file() for name in shown)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ('<a href="b.html#there">b</a><img src="x.png">', []),
        ('<a href="c.html">c</a>', ["a.html: c.html: there is no such file"]),
        ('<a href="b.html#no">b</a>', ["a.html: b.html#no: there is no such place"]),
        ('<a href="#no">b</a>', ["a.html: #no: there is no such place"]),
        ('<script src="https://x.org/x.js"></script>', ["a.html: fetches https://x.org/x.js"]),
        ('<a href="https://x.org/">x</a>', []),
    ],
)
def test_links_that_lead_nowhere_are_named(
    body: str, said: list[str], tmp_path_factory: pytest.TempPathFactory
) -> None:
    site = tmp_path_factory.mktemp("site")
    (site / "a.html").write_text(body)
    (site / "b.html").write_text('<p id="there">')
    (site / "x.png").write_bytes(b"")
    assert list(module(".ci/check_site.py").problems(site)) == said
