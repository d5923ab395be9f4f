"""The page on the scene format: its scenes load, and no key of the format is missing from it."""

import re
from pathlib import Path

import pytest

from mstmm.hinge_types import HINGE_TYPES
from mstmm.scene import (
    Body,
    Event,
    Friction,
    Hinge,
    Law,
    Limits,
    Load,
    Scene,
    Spring,
    SpringLaw,
    Table,
    load_scene,
)

PAGES = Path(__file__).parents[1] / "docs" / "use"
BLOCKS = [
    pytest.param(block, id=f"{page.stem}-{i}")
    for page in sorted(PAGES.glob("**/*.md"))
    for i, block in enumerate(
        re.findall(r"^```toml\n(.*?)^```", page.read_text("utf-8"), re.M | re.S)
    )
]
FORMAT = (PAGES / "scenes.md").read_text("utf-8")


@pytest.mark.parametrize("block", BLOCKS)
def test_scene_loads(block: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(block, encoding="utf-8")
    scene = load_scene(path)
    path.write_text(scene.to_toml(), encoding="utf-8")
    assert load_scene(path) == scene


@pytest.mark.parametrize(
    "table",
    [Scene, Body, Hinge, Law, Friction, Limits, Load, Spring, SpringLaw, Event],
    ids=lambda t: t.__name__,
)
def test_every_key_is_described(table: type[Table]) -> None:
    keys = {field.alias or name for name, field in table.model_fields.items()}
    missing = {key for key in keys if f"`{key}`" not in FORMAT}
    assert not missing


def test_every_hinge_type_is_described() -> None:
    assert {name for name in HINGE_TYPES if f"`{name}`" not in FORMAT} == set()


def test_first_scene_has_about_ten_lines() -> None:
    first = re.search(r"```toml\n(.*?)```", FORMAT, re.S)
    assert first is not None and len(first.group(1).splitlines()) <= 13
