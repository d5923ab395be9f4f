"""The page on the scene format: its scenes load, and no key of the format is missing from it."""

from pathlib import Path

import pytest

import mstmm
from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.scene import (
    Arrays,
    Beam,
    Body,
    Box,
    Bushing,
    Chain,
    Constraint,
    Coupling,
    Damping,
    Elastic,
    ElasticEnd,
    Event,
    Friction,
    Hinge,
    InitialDeformation,
    Input,
    Law,
    Limits,
    Load,
    Modes,
    Output,
    Scene,
    Section,
    Shapes,
    Signal,
    Spring,
    SpringLaw,
    load_scene,
)
from mstmm.scene.validators.scalars_and_vectors import Table
from tests.support.pages import Follow, block_texts, page_text

PAGE = "docs/reference/scene-format.md"
BLOCKS = block_texts(PAGE, "toml")
FORMAT = page_text(PAGE)


@pytest.mark.parametrize("block", BLOCKS, ids=range(len(BLOCKS)))
def test_scene_loads(block: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(block, encoding="utf-8")
    scene = load_scene(path)
    path.write_text(scene.to_toml(), encoding="utf-8")
    assert load_scene(path) == scene


@pytest.mark.parametrize("block", BLOCKS, ids=range(len(BLOCKS)))
def test_scene_runs(block: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(block, encoding="utf-8")
    result = mstmm.compile(mstmm.load_scene(path)).simulate(t_end=5.0)
    assert result.success, result.message
    stopped = "stop" in block.partition("[[event]]")[2]
    assert (result.t[-1] < 5.0) == stopped


@pytest.mark.parametrize(
    "table",
    [
        Scene, Body, Hinge, Chain, Law, Friction, Limits, Load, Spring, Bushing, SpringLaw, Event,
        Beam, Section, Modes, Shapes, Damping, InitialDeformation, Elastic, ElasticEnd, Arrays, Box,
        Input,
        Signal, Output, Constraint, Coupling,
    ],
    ids=lambda t: t.__name__,
)  # fmt: skip
def test_every_key_is_described(table: type[Table]) -> None:
    keys = {field.alias or name for name, field in table.model_fields.items()}
    missing = {key for key in keys if f"`{key}`" not in FORMAT}
    assert not missing


def test_every_hinge_type_is_described() -> None:
    assert {name for name in builtin_hinges() if f"`{name}`" not in FORMAT} == set()


def test_first_scene_has_the_energy_it_began_with(play_page: Follow) -> None:
    energy = float(play_page(PAGE).printed.splitlines()[0].split()[-1])
    assert energy == pytest.approx(9.81 * 0.5 * 0.29552020666134, abs=1e-6)
