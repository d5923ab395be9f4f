"""The page opened without a network: no console errors, motion, a tooltip for each body."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.support.scenes import view as scenes
from tests.support.view import browser
from tests.support.view.picture_comparison import blocks, matches_picture

pytestmark = pytest.mark.skipif(browser.PROGRAM is None, reason="Chromium is not installed")

#: Puts the pointer over the origin of the hub; the text that the page then shows.
POINT = """(() => {
  const view = window.__viserMutable, node = view.nodeRefFromName['/bodies/hub'];
  if (!node) return '';
  const at = node.localToWorld(new view.camera.position.constructor(0, 0, 0)).project(view.camera);
  const frame = view.canvas.getBoundingClientRect();
  dispatchEvent(new PointerEvent('pointermove', {
    clientX: frame.left + (at.x + 1) / 2 * frame.width,
    clientY: frame.top + (1 - at.y) / 2 * frame.height}));
  return [...document.querySelectorAll('div')].filter((d) => d.style.whiteSpace === 'pre' &&
    d.style.display === 'block').map((d) => d.textContent).join('');
})()"""


def test_the_scene_looks_as_it_did(tmp_path: Path) -> None:
    path = tmp_path / "start.html"
    scenes.model().simulate(0.0).view(path)
    with browser.open_page(path) as page:
        size = {"width": 900, "height": 600, "deviceScaleFactor": 1, "mobile": False}
        page.ask("Emulation.setDeviceMetricsOverride", **size)
        assert page.wait("document.querySelector('#mstmm div').textContent")
        free = (180, 190, 880, 590)  # nothing but the scene is there
        assert page.wait_for_picture(
            lambda picture: matches_picture(blocks(picture, free, (14, 8)), "start.png")
        )
        # A scene that does not move: the same body is in front whenever the browser gets to it.
        assert page.wait(POINT).split("\n")[:2] == ["hub", "mass 2 kg"]


def test_a_page(tmp_path: Path) -> None:
    path = tmp_path / "run.html"
    scenes.run().view(path, title="a <b>beam</b> & a rod", trails=["rod.tip"])
    assert path.stat().st_size < 10_000_000
    with browser.open_page(path) as page:
        clock = "(document.querySelector('#mstmm div') || {}).textContent"
        assert page.wait(f"/t = 0\\.[1-9]/.test({clock})"), page.console
        assert (
            page.value("document.querySelector('#mstmm b').textContent") == "a <b>beam</b> & a rod"
        )
        assert page.value("document.title") == "a <b>beam</b> & a rod"
        # A body or hinge has a tooltip while it moves; which one is in front varies.
        names = {part["name"] for kind in ("beam", "body", "hinge") for part in scenes.SCENE[kind]}
        assert page.wait(POINT).split("\n")[0] in names
        seen = np.asarray(Image.open(io.BytesIO(page.picture())).convert("RGB"))
        assert page.console == []
    canvas = seen[100:400, 250:800].reshape(-1, 3)
    assert len(np.unique(canvas // 16, axis=0)) > 20
