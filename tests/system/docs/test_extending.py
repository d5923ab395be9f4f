"""The pages on elements of one's own: what their Python leaves behind is right."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.support.pages import Follow

PAGES = "docs/howto"


@pytest.mark.slow
def test_hinge(play_page: Follow) -> None:
    page = play_page(f"{PAGES}/define-a-hinge.md")
    assert page.printed.startswith("compiled\n")
    result = page.names["result"]
    assert result.success
    assert np.all(np.diff(result.energy()) < 1e-9)  # the law's damper takes energy
    assert page.names["Pilot"].name == "pilot"
    assert (page.folder / "kernels" / "hinge_pilot" / "element.json").is_file()


def test_body(play_page: Follow) -> None:
    page = play_page(f"{PAGES}/define-a-body.md")
    gaps = [float(x) for x in re.findall(r"-?\d\.?\d*(?:e[-+]\d+)?", page.printed)]
    assert len(gaps) == 9
    assert max(map(abs, gaps)) < 1e-8
    assert np.ptp(page.names["result"].energy()) < 1e-8


def test_force(play_page: Follow) -> None:
    names = play_page(f"{PAGES}/define-a-force-element.md").names
    y = names["result"].position("mount")[-1, 1]
    assert 4e3 * y + 3e7 * y**3 == pytest.approx(-2 * 9.81, rel=1e-4)
    assert names["stiffer"].parameters["rubber.parameters.stiffness"] == 8e3


def test_stepper(play_page: Follow) -> None:
    printed = play_page(f"{PAGES}/define-an-integration-method.md").printed
    ratios = [float(x) for x in re.findall(r"\d+\.\d+", printed)]
    assert ratios == pytest.approx([8.0, 8.0], rel=0.1)
