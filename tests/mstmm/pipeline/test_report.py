"""The report: opened without a network its console is silent, and it says what the run says."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import mstmm
from mstmm import display
from mstmm.errors import SceneError
from mstmm.pipeline.report import verdict_html
from tests.support.scenes import view as scenes
from tests.support.view import browser
from tests.support.view.picture_comparison import blocks, matches_picture

#: Nothing may be fetched: the page names no other place but in what readers may follow themselves.
_FETCHED = ("<link", '<img src="http', "<script src", "@import")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    return scenes.run().report(
        path, title="a <b>beam</b>", quantities=["rod.tip.position", "root.angle"]
    )


def test_what_it_says(page: Path) -> None:
    text = page.read_text()
    assert page.stat().st_size < 10_000_000
    assert text.index("<iframe") < 1_000_000  # the strip, however much it shows
    assert "<title>a &lt;b&gt;beam&lt;/b&gt;</title>" in text
    assert "<b>NOT trusted</b>: beam &quot;blade&quot;" in text
    for heading in ("The mechanism", "The run", "Curves", "The certificate", "The equations"):
        assert f"<h2>{heading}</h2>" in text
    assert "<summary>rigid body</summary>" in text
    assert "<math" in text
    assert str(scenes.run().certificate.energy) in text
    assert not any(mark in text for mark in _FETCHED)


@pytest.mark.skipif(browser.PROGRAM is None, reason="Chromium is not installed")
def test_opened(page: Path) -> None:
    with browser.open_page(page, (1000, 900)) as seen:
        assert seen.wait("document.querySelectorAll('.curves .trace').length === 4"), seen.console
        inner = "document.querySelector('iframe').contentWindow"
        assert seen.wait(f"{inner}.__viserMutable && {inner}.__viserMutable.canvas && 1")
        assert seen.wait(f"{inner}.document.querySelector('#mstmm div').textContent")
        picture = np.asarray(Image.open(io.BytesIO(seen.picture())).convert("RGB"))
        assert seen.value("document.documentElement.scrollWidth <= innerWidth")
        assert seen.console == []
    assert len(np.unique(picture.reshape(-1, 3) // 16, axis=0)) > 20


#: Where the strip of moments is seen, below the words above them.
STRIP = """(() => {
  const at = document.querySelector('img').getBoundingClientRect();
  return [at.left, at.top + 0.2 * at.height, at.right, at.bottom].map(Math.round);
})()"""


@pytest.mark.skipif(browser.PROGRAM is None, reason="Chromium is not installed")
def test_the_strip_looks_as_it_did(page: Path) -> None:
    with browser.open_page(page) as seen:
        size = {"width": 1000, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        seen.ask("Emulation.setDeviceMetricsOverride", **size)
        assert seen.wait("document.querySelector('img') && document.querySelector('img').complete")
        seen.value("document.querySelector('img').scrollIntoView({block: 'center'})")
        assert seen.wait_for_picture(
            lambda picture: matches_picture(
                blocks(picture, seen.value(STRIP), (18, 4)), "strip.png"
            )
        )


def test_it_tells_how_many_digits_hold_until_when() -> None:
    """Of a pendulum, whose second run differs by a known share of how far it swings."""
    rod = {"name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1]}
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    scene = mstmm.Scene(gravity=[0, -9.81, 0], body=[rod], hinge=[pin])
    run = mstmm.compile(scene, engine="looped").simulate(2.0, rtol=1e-5, certify=True)
    error = run.certificate.error
    assert error is not None
    share = error.largest("q")["rad"] / np.ptp(run.q[:, 0])
    said = r"Up to t = 2 s a second.* by at most (\S+) rad, which is (\d+) digits of"
    found = re.search(said, verdict_html(run))
    assert found is not None
    assert float(found[1]) == pytest.approx(error.largest("q")["rad"], rel=0.05)
    assert 10.0 ** -(int(found[2]) + 1) < share <= 10.0 ** -int(found[2])


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"expected a name ending in \.html"):
        scenes.run().report(tmp_path / "report.pdf")
    with pytest.raises(SceneError, match="there is no such quantity"):
        scenes.run().report(tmp_path / "report.html", quantities=["rod.tip.positron"])


def test_everything_is_escaped() -> None:
    made = display.table([("<script>", "a & b")], ("<i>",)) + display.bullets(["</ul><b>"])
    made += display.collapsible("<x>", "")
    assert "<script>" not in made
    assert "<i>" not in made
    assert "<b>" not in made
    assert "a &amp; b" in made
