"""The page on flexible bodies: what it says of numbers is so."""

from __future__ import annotations

import re
from typing import Any

import pytest

from tests.support.pages import Follow, page_text

PAGE = "docs/howto/flexible-bodies.md"
TEXT = page_text(PAGE)


@pytest.fixture
def page(play_page: Follow) -> dict[str, Any]:
    """The names that the page leaves behind."""
    return play_page(PAGE).names


def words(text: str) -> str:
    """In one line, digits after the first hidden: the last ones depend on the machine."""
    return re.sub(r"(\d)\.\d+", r"\1", " ".join(text.split()))


def test_the_rod_is_drawn(play_page: Follow) -> None:
    assert (play_page(PAGE).folder / "rod.png").stat().st_size > 10000


def test_the_spun_blade_bends_as_published(page: dict[str, Any]) -> None:
    assert page["tip"].min() == pytest.approx(-0.57375, abs=1e-3)
    assert page["spun"].warnings == ()


def test_the_certificate_is_the_one_shown(page: dict[str, Any]) -> None:
    shown = re.search(r"^```text\n(blade .*?)```", TEXT, re.M | re.S)
    assert shown is not None
    said = str(page["spun"].certificate)
    assert words(shown[1]) in words(said)


def test_the_linear_blade_is_warned_about(page: dict[str, Any]) -> None:
    assert any("first frequency" in text for text in page["lost"].warnings)
    assert page["lost"].deflection("blade", "tip")[:, 1].min() < -2


def test_notes_are_those_shown(page: dict[str, Any]) -> None:
    shown = re.findall(r"^```text\n(?=[yz]:)(.*?)\n```", TEXT, re.M | re.S)
    chosen = page["mstmm"].compile(page["scene"]).flexible_bodies["rod"].notes
    assert words("\n".join(chosen)) == words(shown[0])
    carrying = page["mstmm"].compile(page["carrying"]).flexible_bodies["arm"]
    assert words(carrying.notes[-1]) == words(shown[1])


def test_the_static_start_is_the_closed_form(page: dict[str, Any]) -> None:
    assert page["sway"].deflection("arm", "tip")[0, 1] == pytest.approx(-9.81 / 400, rel=5e-4)
    assert page["sway"].bending_moment("arm", 0.0)[0, 1] == pytest.approx(-9.81 / 2, rel=1e-3)


def test_the_hanging_rod_vibrates_as_a_pinned_beam(page: dict[str, Any]) -> None:
    """Pinned-free: beta^2 sqrt(EI / rho A) / L^2, raised by the weight."""
    found = sorted(abs(page["np"].linalg.eigvals(page["small"].state_matrix).imag))[::2]
    for got, beta in zip(found[1:3], (3.926602, 7.068583), strict=True):
        assert 0 < got / (beta**2 * 10**0.5) - 1 < 0.03
    assert all(f"{f:.3g}" in TEXT for f in found)


def test_the_strip_bends_like_the_exact_cantilever(page: dict[str, Any]) -> None:
    """Bisshopp and Drucker, Q. Appl. Math. 3 (1945): 0.810609 L under 10 EI/L^2."""
    tip = page["model"].positions(page["rest"], "strip.tip")
    assert tip[1] == pytest.approx(0.810609, abs=2e-6)
    assert ", ".join(f"{x:.6f}" for x in tip[:2]) in TEXT
