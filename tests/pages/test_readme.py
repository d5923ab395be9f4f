"""The README as a newcomer follows it: what its files, commands and Python leave behind."""

from __future__ import annotations

import pytest
from pages.blocks import Follow


@pytest.mark.slow
def test_runs_beams_pictures_and_pages(played: Follow) -> None:
    page = played("README.md")
    assert "finished at t = 5 s" in page.printed and "frame chord" in page.printed
    assert page.names["result"].warnings == ()  # of the beam
    for name in ("pendulum.nc", "pendulum.png", "rigid.html", "rod.png"):
        assert (page.folder / name).stat().st_size > 1000
