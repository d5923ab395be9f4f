"""Strips, films and frames: there is something on them, and it moves."""

from __future__ import annotations

import math
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

from mstmm.errors import EnvironmentFailure
from mstmm.runtime.result.scene3d.projection import ProjectedFrame
from mstmm.runtime.result.scene3d.scene_builder import build_scene_graph
from mstmm.runtime.result.scene3d.view import SceneView, _column_count
from tests.support.scenes import view as scenes


@pytest.fixture(scope="module")
def view() -> SceneView:
    return SceneView("", [("", build_scene_graph(scenes.run(), "a beam and a rod", speed=20.0))])


@pytest.mark.parametrize("shape", [0.3, 0.7, 1.5])
def test_rows_of_a_strip_are_alike(shape: float) -> None:
    for count in range(1, 13):
        columns = _column_count(count, shape)
        rows = math.ceil(count / columns)
        assert rows * columns - count < rows


def test_a_strip(view: SceneView, tmp_path: Path) -> None:
    view.save(tmp_path / "strip.png", moments=3)
    picture = np.asarray(Image.open(tmp_path / "strip.png").convert("RGB"))
    thirds = np.array_split(picture, 3, axis=1)
    inked = [(third < 200).any(axis=2).mean() for third in thirds]
    assert min(inked) > 0.01
    assert not np.array_equal(thirds[0][:, : thirds[2].shape[1]], thirds[2])


def test_a_gif_has_every_moment(view: SceneView, tmp_path: Path) -> None:
    view.save(tmp_path / "film.gif")
    rate = (len(view.stage.times) - 1) * 20.0 / 2.0
    with Image.open(tmp_path / "film.gif") as film:
        frames = sum(1 for _ in ImageSequence.Iterator(film))
        assert frames == len(range(0, len(view.stage.times), round(rate / 15)))
        assert film.info["duration"] == pytest.approx(1000 / 15, abs=10)


def test_frames(view: SceneView, tmp_path: Path) -> None:
    view.save(tmp_path / "frames")
    made = sorted((tmp_path / "frames").iterdir())
    assert [path.name for path in made] == [
        f"frame_{k + 1:04d}.png" for k in range(len(view.stage.times))
    ]


def test_an_mp4_without_its_program(
    view: SceneView, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(EnvironmentFailure, match=r"ffmpeg.*or use a name ending in \.gif"):
        view.save(tmp_path / "film.mp4")


def test_an_mp4(view: SceneView, tmp_path: Path) -> None:
    view.save(tmp_path / "film.mp4")
    assert (tmp_path / "film.mp4").read_bytes()[4:8] == b"ftyp"


def test_what_is_near_hides_what_is_far(view: SceneView) -> None:
    corners, colours = ProjectedFrame(view.stage)._triangles(0)
    low, high = ProjectedFrame(view.stage).window
    assert len(corners) == len(colours) > 100
    assert (corners >= low - 1e-9).all()
    assert (corners <= high + 1e-9).all()


def test_endings_of_any_case_and_nobody_else_s_settings(view: SceneView, tmp_path: Path) -> None:
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    view.save(tmp_path / "FILM.GIF")
    assert (tmp_path / "FILM.GIF").read_bytes()[:4] == b"GIF8"
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize("name", ["film.gif", "strip.png", "frames"])
def test_without_the_extra_it_is_named(
    view: SceneView, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in [*(m for m in sys.modules if m.startswith("matplotlib")), "matplotlib"]:
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(EnvironmentFailure, match=r"mstmm\[plot\]"):
        view.save(tmp_path / name)
    assert not [path for path in tmp_path.iterdir() if path.is_file()]
