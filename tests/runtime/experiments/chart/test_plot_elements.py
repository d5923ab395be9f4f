"""The picture and the page: what stands in them, and that nothing stands on something else."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import pytest

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.experiments.chart.chart import Chart
from mstmm.runtime.experiments.chart.chart_record import Point, Skipped
from mstmm.runtime.experiments.chart.plot_elements import (
    MARKS,
    build_drawing,
    decades,
    family_mark,
    level_colours,
    method_styles,
    plot_position,
    time_text,
)
from mstmm.runtime.experiments.chart.tables import skip_reasons
from mstmm.runtime.experiments.method_families import FAMILIES, all_methods, family
from mstmm.runtime.experiments.trial import Setting
from tests.support.scenes.chart import hub, pendulum

METHODS = ("dop853", "dopri5", "rodas4p2", "genalpha", "rk4")

#: Elements that stand alone.
_VOID = {"meta", "br", "link", "img", "input", "hr"}


@cache
def one_level() -> Chart:
    model = mstmm.compile(pendulum(), engine="looped")
    return mstmm.chart(
        model, 1.0, methods=METHODS, samples=11, rounds=0, budget=300, title="a <swing> & more"
    )


@cache
def levels() -> Chart:
    return mstmm.chart(
        hub(), 0.6, methods=METHODS[:3], models=True, samples=11, rounds=0, budget=300
    )


class Page(HTMLParser):
    """Elements as they open and close."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[tuple[str, str]] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open:
            self.words.append((self.open[-1], data))


@pytest.mark.parametrize("made", [one_level, levels])
def test_the_page_stands_alone(made: Callable[[], Chart]) -> None:
    chart = made()
    text = chart.to_html()
    page = Page(text)
    assert not page.open
    assert "script" not in {tag for tag, _ in page.seen}
    assert not re.search(r"https?:|@import|url\((?!#)", text)
    assert not [a for tag, a in page.seen if "src" in a or "href" in a]
    shown = [w for tag, w in page.words if tag == "title" and "CPU, smallest of" in w]
    inside = build_drawing(chart)
    assert len(shown) == sum(len(line.points) for line in inside.lines if line.style.mark)
    for point in chart.pareto_front:
        assert any(f"{point.method}, {point.setting}" in w and point.model in w for w in shown)


def test_names_of_the_user_are_words_and_no_elements() -> None:
    text = one_level().to_html()
    assert "a &lt;swing&gt; &amp; more" in text
    assert "<swing>" not in text


def test_every_point_that_ran_is_drawn_once() -> None:
    for chart in (one_level(), levels()):
        made = build_drawing(chart)
        drawn = [point for line in made.lines if line.style.mark for _, point in line.points]
        ran = [point for point in chart.points if plot_position(point) is not None]
        assert len(drawn) + made.beyond == len(ran)
        for line in made.lines:
            for (x, y), _ in line.points:
                assert made.x[1] <= x <= made.x[0] or x < made.x[1]
                assert made.y[0] <= y <= made.y[1]
        assert len(made.pareto_front) == len(
            [p for p in chart.pareto_front if plot_position(p) is not None]
        )


def test_wild_errors_do_not_shrink_the_rest() -> None:
    wild = Point(Setting("rk4", "as given", 0.5, fixed=True), 1e40, 1e-5, 1, error_bound=1e40)
    chart = replace(one_level(), points=(wild, *one_level().points))
    made = build_drawing(chart)
    assert made.x[0] < 10
    assert made.beyond == 1
    assert "outside the plot" in chart.to_html()


def test_a_scene_at_rest_says_so(tmp_path: Path) -> None:
    """A pendulum at rest without gravity stays where it is, by every method."""
    said: list[str] = []
    hanging = pendulum().model_copy(update={"gravity": (0.0, 0.0, 0.0)})
    made = mstmm.chart(
        hanging, 1.0, methods=METHODS, samples=3, rounds=0, budget=300, state=said.append
    )
    assert "the scene has no degrees of freedom" in said[-1]
    assert not made.points
    with pytest.raises(NumericalFailure, match="the scene has no degrees of freedom"):
        made.recommend(1e-3)
    assert made.to_dict()["reference"]["still"] is True
    assert made.recommendations() == []
    assert build_drawing(made).empty == "the scene has no degrees of freedom"
    assert not made.plot().axes[0].axison
    assert "The scene has no degrees of freedom" in made.to_html()
    assert not build_drawing(one_level()).empty
    assert len(made.save(tmp_path)) == 3


def test_long_words_below_the_title_are_not_cut() -> None:
    chart = one_level()
    reference = replace(chart.reference, stop_event='stopped by event "end" at t = 0.5 s')
    figure = replace(chart, reference=reference).plot()
    lines = [text.get_text() for text in figure.texts]
    first = next(i for i, line in enumerate(lines) if line.startswith("1 s of motion"))
    assert (
        " ".join(lines[first : first + 2])
        == build_drawing(replace(chart, reference=reference)).below
    )
    assert max(map(len, lines)) <= 150


def test_points_of_levels_are_joined_by_their_methods() -> None:
    made = build_drawing(levels())
    paths = [line for line in made.lines if not line.style.mark and not line.is_emphasised]
    curves = {p.curve for p in levels().points if plot_position(p) is not None}
    assert len(paths) == len(curves)
    assert all(line.is_connected for line in paths)
    assert all(len({p.curve for _, p in line.points}) == 1 for line in paths)


def test_the_legend_of_levels_names_their_methods() -> None:
    rows = [entry.text for entry in build_drawing(levels()).legend]
    assert rows[rows.index("explicit") + 1] == "dop853, dopri5"
    assert rows[rows.index("Rosenbrock") + 1] == "rodas4p2"
    assert all(f">{method}<" in levels().to_html() for method in ("rodas4p2",))


def test_labels_stand_below_the_front() -> None:
    for chart in (one_level(), levels()):
        assert all(label.at[1] > 0 for label in build_drawing(chart).labels)


def test_labels_do_not_meet() -> None:
    for chart in (one_level(), levels()):
        made = build_drawing(chart)
        assert made.labels
        boxes = []
        for label in made.labels:
            right = (label.position[0] - made.x[0]) / (made.x[1] - made.x[0]) * 450 + label.at[0]
            down = (made.y[1] - label.position[1]) / (made.y[1] - made.y[0]) * 370 + label.at[1]
            wide = 2.6 * len(label.text)
            boxes.append((right - wide, down - 5, right + wide, down + 5))
        for i, a in enumerate(boxes):
            assert a[0] >= 0 and a[2] <= 450 and a[1] >= 0 and a[3] <= 370
            assert not any(
                a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3] for b in boxes[:i]
            )


def test_the_picture(tmp_path: Path) -> None:
    figure = levels().plot(tmp_path / "levels.png")
    data = (tmp_path / "levels.png").read_bytes()
    width, height = struct.unpack(">II", data[16:24])
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert width > 1000 and height > 700
    words = {text.get_text() for text in figure.texts}
    assert {level.name for level in levels().model_levels} <= words
    (axes,) = figure.axes
    assert axes.get_xlim()[0] > axes.get_xlim()[1]  # more accurate to the right
    with pytest.raises(SceneError, match=r"ends in \.png, \.svg or \.pdf"):
        levels().plot(tmp_path / "levels.xyz")


def test_files(tmp_path: Path) -> None:
    made = one_level().save(tmp_path / "new" / "folder")
    assert [path.name for path in made] == ["chart.html", "chart.json", "chart.png"]
    assert all(path.stat().st_size > 1000 for path in made)


def test_methods_look_like_their_families() -> None:
    looks = method_styles(all_methods())
    assert set(looks) == set(all_methods())
    assert {family(name) for name in looks} == set(FAMILIES)
    assert len({(look.colour, look.mark) for look in looks.values()}) == len(looks)
    assert len({family_mark(name) for name in looks}) == len(FAMILIES)
    assert set(MARKS) >= {look.mark for look in looks.values()}
    levels = [
        "rigid",
        "one-way, 1 shape",
        "linear, 1 shape",
        "linear, 2 shapes",
        "stiffened, 1 shape",
    ]
    assert len(set(level_colours(levels).values())) == len(levels)


def test_words_of_times() -> None:
    assert [time_text(power) for power in (1, 0, -1, -3, -5, -9, -12)] == [
        "10 s", "1 s", "100 ms", "1 ms", "10 µs", "1 ns", "1e-12 s",
    ]  # fmt: skip
    assert decades(0.3, -2.0) == [-2, -1, 0]


def test_reasons_are_told_once() -> None:
    entries = [
        Skipped("rk4", "rigid", "step 1 s and tighter", "no time", False),
        Skipped("rk4", "linear", "step 1 s and tighter", "no time", False),
        Skipped("dop853", "linear", "rtol 1e-05 and tighter", "no time", False),
        Skipped("auto", "rigid", "rtol 1e-04 and tighter", "no time", False),
        Skipped("auto", "linear", "rtol 1e-05 and tighter", "no time", False),
        Skipped("", "one-way", "", "no such level", True),
        Skipped("", "", "", "no rounds", False),
    ]
    assert skip_reasons(entries, False) == [
        "rk4, step 1 s and tighter (2 levels); dop853, rtol 1e-05 and tighter; auto (2 levels): "
        "no time",
        "no rounds",
    ]  # fmt: skip
    assert (
        skip_reasons(entries, False, 1)[0]
        == "rk4, step 1 s and tighter (2 levels); and 2 more: no time"
    )
    assert skip_reasons(entries, True) == ["one-way: no such level"]
