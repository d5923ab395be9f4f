"""The README and the tutorials as a newcomer follows them: what their code leaves behind."""

from __future__ import annotations

import pytest

from tests.support.pages import Follow, page_text


@pytest.mark.slow
def test_the_readme_simulates_plots_and_reports(play_page: Follow) -> None:
    page = play_page("README.md")
    assert "finished at t = 5 s" in page.printed and "\nTrue\n" in page.printed
    for name in ("pendulum.nc", "pendulum.png", "pendulum.html", "pendulum-report.html"):
        assert (page.folder / name).stat().st_size > 1000


def test_the_readme_is_read_in_five_minutes() -> None:
    text = page_text("README.md")
    assert text.count("\n") <= 150 and len(text.split()) < 1000


@pytest.mark.slow
def test_the_tutorials_leave_a_trusted_beam_and_a_page_of_equations(play_page: Follow) -> None:
    beam, hinge = play_page("docs/tutorials/beam.md"), play_page("docs/tutorials/hinge.md")
    assert "frame chord" in beam.printed and beam.names["result"].warnings == ()
    assert (beam.folder / "rod.png").stat().st_size > 1000
    assert (hinge.folder / "rigid.html").stat().st_size > 1000
