"""The drawings of the pages of theory: `python docs/drawings/draw.py` writes them beside itself."""

from __future__ import annotations

from itertools import pairwise
from math import sin
from pathlib import Path

import pen


def one_rod() -> str:
    """What acts on a rod cut free at both ends."""
    i, o, c = (160, 220), (480, 100), (320, 160)
    return pen.page(
        640, 320, "A rod with input end I, mass centre C and output end O, and what acts on it",
        pen.rod(i, o, 22), *map(pen.dot, (i, c, o)),
        pen.name((178, 250), "I"), pen.name((330, 206), "C"), pen.name((488, 146), "O"),
        pen.arrow(i, (74, 196)), pen.name((56, 192), "q", "I"),
        pen.arrow(o, (572, 142)), pen.name((592, 150), "q", "O", "−"),
        pen.turn(i, 48, 200, 280), pen.name((106, 282), "m", "I"),
        pen.turn(o, 48, 70, -10), pen.name((548, 62), "m", "O", "−"),
        pen.arrow(c, (320, 258)), pen.name((346, 256), "Mg"),
        pen.arrow((148, 188), (308, 128), "line"), pen.name((214, 148), "c"),
        pen.arrow((136, 156), (456, 36), "line"), pen.name((286, 84), "r"),
    )  # fmt: skip


def a_pin() -> str:
    """What passes a pin, and what is new behind it."""
    a, p, b = (70, 190), (310, 130), (520, 230)
    return pen.page(
        640, 290, "Two rods on a pin: acceleration and force pass, the angular acceleration is new",
        pen.rod(a, p), pen.rod(p, b), pen.joint(p),
        pen.arrow(p, (382, 66)), pen.name((412, 64), "q"),
        pen.words((322, 30), "a and q pass on, m = 0"),
        pen.turn(p, 62, -10, -50), pen.name((398, 148), "α"), pen.words((452, 148), "is new"),
        pen.dot(b), pen.words((450, 274), "next pin, or a free tip: m = 0 there too"),
    )  # fmt: skip


def the_sweep() -> str:
    """Tips to root, root to tips."""
    points = [(70.0, 150.0), (200.0, 116.0), (330.0, 168.0), (460.0, 124.0), (580.0, 150.0)]
    pairs = list(pairwise(points))
    inward = (
        pen.arrow(((a[0] + b[0]) / 2 + 34, 62), ((a[0] + b[0]) / 2 - 34, 62)) for a, b in pairs
    )
    outward = (
        pen.arrow(((a[0] + b[0]) / 2 - 34, 232), ((a[0] + b[0]) / 2 + 34, 232), "line")
        for a, b in pairs
    )
    return pen.page(
        660, 292, "A chain: tips to root S and e are gathered, root to tips accelerations go out",
        pen.ground(points[0]), *(pen.rod(a, b) for a, b in pairs), *map(pen.joint, points[:-1]),
        pen.dot(points[-1]), *inward, *outward,
        pen.words((330, 34), "tips to root: f = S a + e, a body absorbed, a hinge crossed"),
        pen.words((330, 268), "root to tips: accelerations, then forces"),
        pen.name((600, 70), "S = 0"), pen.name((60, 228), "a = 0"),
    )  # fmt: skip


def ends_and_hinges() -> str:
    """The names of ends and points."""
    p, left, right = (262, 170), (470, 70), (480, 236)
    inboard = ((30, 210), (60, 120), (150, 130), (215, 160), (190, 220), (100, 250))
    outboard = ((236, 176), (290, 90), (480, 30), (520, 80), (450, 150), (540, 250), (470, 280))
    return pen.page(
        660, 320, "An inboard and an outboard body, joined from Q to P, and two output ends",
        pen.blob(*inboard), pen.blob(*outboard),
        pen.dot((190, 182)), pen.dot(p), pen.line((190, 182), p, kind="thin"),
        pen.name((180, 212), "Q"), pen.name((270, 206), "P = I"),
        pen.dot(left), pen.name((492, 62), "O", "1"),
        pen.dot(right), pen.name((502, 230), "O", "2"),
        pen.arrow(p, (304, 120)), pen.name((330, 126), "q, m"),
        pen.words((110, 186), "inboard"), pen.words((396, 196), "outboard"),
        pen.words((232, 256), "hinge"), pen.line((228, 242), (226, 184), kind="thin"),
        pen.words((64, 296), "root"), pen.arrow((96, 291), (560, 291), "line"),
        pen.words((588, 296), "tips"),
    )  # fmt: skip


def a_hinge() -> str:
    """Two frames and what a hinge says of them."""
    q, p = (170, 230), (420, 130)
    return pen.page(
        640, 300, "A hinge: the outboard frame at P, seen from the inboard frame at Q",
        pen.axes(q, 0, 70), pen.axes(p, 34, 70), pen.dot(q), pen.dot(p),
        pen.name((156, 252), "Q"), pen.name((424, 156), "P"),
        pen.arrow(q, (412, 133), "push"), pen.name((270, 170), "d(q)"),
        pen.line(p, (510, 130), kind="thin"), pen.turn(p, 56, 0, 24), pen.name((506, 118), "R(q)"),
        pen.words((170, 284), "inboard axes"), pen.words((450, 200), "outboard axes"),
        pen.name((470, 262), "[v; w] = H(q) u"),
    )  # fmt: skip


def a_loop() -> str:
    """A ring of bodies, cut at one hinge."""
    ring = [(110, 220), (150, 90), (300, 60), (392, 118)]
    back = [(408, 132), (470, 220)]
    return pen.page(
        640, 300, "A loop cut at one hinge: what held it are multipliers, with both signs",
        pen.ground((96, 220)), pen.line((470, 250), (440, 250)), pen.line((455, 232), (455, 250)),
        *(pen.rod(a, b) for a, b in pairwise(ring)), pen.rod(*back),
        *map(pen.joint, (*ring[:3], back[1])), pen.dot(ring[3]), pen.dot(back[0]),
        pen.arrow((408, 132), (476, 84)), pen.name((512, 86), "N x"),
        pen.arrow((392, 118), (330, 164)), pen.name((306, 184), "N x", sign="−"),
        pen.line((372, 164), (430, 88), kind="thin"),
        pen.words((448, 50), "cut here: a tree is left"),
        pen.name((280, 262), "N · (difference of accelerations) = 0"),
    )  # fmt: skip


def floating_frame() -> str:
    """A beam that bends, and the frame that it bends in."""
    bent = [(110 + 4 * k, 220 - 0.5 * k - 52 * sin(k / 100 * 1.6) * k / 100) for k in range(101)]
    straight = (bent[0], (510.0, 170.0))
    high = [(x - 6, y - 15) for x, y in bent]
    low = [(x + 6, y + 15) for x, y in bent]
    outline = " ".join(f"{x:.1f} {y:.1f}" for x, y in (*high[::4], *low[::-4]))
    return pen.page(
        640, 320, "A beam that bends, in the frame that floats with its input end",
        f'<path class="body" d="M{outline}z"/>', pen.line(*straight, kind="thin"),
        pen.axes(bent[0], 7, 74), pen.dot(bent[0]), pen.name((98, 244), "I"),
        pen.dot((390.0, 185.0)), pen.dot(bent[70]), pen.arrow((390.0, 185.0), bent[70]),
        pen.name((384, 118), "Ψ(x) η"), pen.name((394, 210), "x"),
        pen.dot(bent[100]), pen.name((534, 122), "O"),
        pen.arrow((40, 290), (104, 226), "line"), pen.name((54, 256), "r", "I"),
        pen.axes((40, 290), 0, 60),
        pen.words((330, 300), "place = motion of the frame + what the shapes add in it"),
    )  # fmt: skip


DRAWINGS = {
    "rod": one_rod,
    "pin": a_pin,
    "sweep": the_sweep,
    "ends": ends_and_hinges,
    "hinge": a_hinge,
    "loop": a_loop,
    "floating": floating_frame,
}

if __name__ == "__main__":
    for file, drawing in DRAWINGS.items():
        Path(__file__).with_name(f"{file}.svg").write_text(drawing(), encoding="utf-8")
