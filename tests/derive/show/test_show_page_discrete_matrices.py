"""`mstmm show` of the discrete-time matrices: their numbers, units, states, readable premises."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from mstmm.derive.classical.catalogue import BODIES, CLASSICAL, DISCRETE_DERIVATIONS, HINGES
from mstmm.derive.show.plain_text import WIDTH, column_count
from mstmm.derive.show.show_page import show_view
from mstmm.derive.show.subjects import element_view

#: Printed matrices and the numbers of their equations.
NUMBERS = {
    "beam_planar_discrete": "(8.89)",
    "beam_spatial_discrete": "(8.186)",
    "hinge_smooth_planar_beam_beam": "(8.98)",
    "hinge_smooth_planar_rigid_beam": "(8.101)",
    "hinge_spring_planar_beam_beam": "(8.121)",
    "hinge_fixed_planar_beam_beam": "(8.135)",
    "hinge_fixed_spatial_rigid_beam": "(8.193)",
    "hinge_fixed_spatial_beam_beam": "(8.199)",
    "hinge_ball_spatial_beam_beam": "(8.209)",
    "hinge_elastic_spatial_beam_beam": "(8.227)",
}


@pytest.mark.parametrize("name", DISCRETE_DERIVATIONS)
def test_text_fits_the_page_and_names_number_and_units(name: str) -> None:
    for at in ("equations", "matrix"):
        text = show_view(element_view(f"classical_{name}"), at, "text")
        assert max(column_count(line) for line in text.splitlines()) <= WIDTH
        assert "source: Rui, Wang, Zhang" in text and "N·m" in text
        assert len(text) < 30_000
    number = NUMBERS.get(name)
    if number is not None:
        assert f"transfer matrix · {number}" in text
    assert "blocks: position, angle, moment, force" in text


@pytest.mark.parametrize("name", ["beam_planar_discrete", "hinge_elastic_spatial_beam_beam"])
@pytest.mark.parametrize("at", ["equations", "matrix", "ir", "c"])
def test_html_and_latex_are_whole(name: str, at: str) -> None:
    page = element_view(name)
    html = show_view(page, at, "html")
    root = ElementTree.fromstring(html.removeprefix("<!DOCTYPE html>\n"))
    assert root.tag == "html" and len(html) < 400_000
    latex = show_view(page, at, "latex")
    begun, ended = (re.findall(rf"\\{word}\{{(\w+\*?)\}}", latex) for word in ("begin", "end"))
    assert sorted(begun) == sorted(ended)


def test_premises_read_as_the_field_writes_them() -> None:
    text = show_view(element_view("beam_planar_discrete"), "equations", "text")
    assert "R (S_t η̈ + 2 w (S_t η̇)⊥ + ẇ c⊥ + m a − w² c) = f_r + q_I − q_O" in text
    assert "D_f η̇ + K_f η_I + i_f = l_f" in text
    assert "η̈ = A η_I + B_eta" in text and "η̇ = C η_I + D_eta" in text
    text = show_view(element_view("beam_planar_discrete"), "matrix", "text")
    assert "Z = X (A M + C N_b + L_b) Xᵀ" in text
    text = show_view(element_view("hinge_smooth_planar_beam_beam"), "matrix", "text")
    assert "K = (V G)⁻¹ (V E)" in text and "U_h = E − G K" in text


def test_every_name_is_registered() -> None:
    assert set(DISCRETE_DERIVATIONS) <= set(CLASSICAL)
    assert len(DISCRETE_DERIVATIONS) == len(BODIES) + 4 * len(HINGES)
