"""The drawings of the pages of theory: `python docs/drawings/draw.py` writes them beside itself."""

from __future__ import annotations

from itertools import pairwise
from math import sin
from pathlib import Path

import svg_drawing


def one_rod() -> str:
    """What acts on a rod cut free at both ends."""
    i, o, c = (160, 220), (480, 100), (320, 160)
    return svg_drawing.page(
        640,
        320,
        "A rod with input end I, mass centre C and output end O, and what acts on it",
        svg_drawing.rod(i, o, 22),
        *map(svg_drawing.dot, (i, c, o)),
        svg_drawing.name((178, 250), "I"),
        svg_drawing.name((330, 206), "C"),
        svg_drawing.name((488, 146), "O"),
        svg_drawing.arrow(i, (74, 196)),
        svg_drawing.name((56, 192), "q", "I"),
        svg_drawing.arrow(o, (572, 142)),
        svg_drawing.name((592, 150), "q", "O", "−"),
        svg_drawing.turn(i, 48, 200, 280),
        svg_drawing.name((106, 282), "m", "I"),
        svg_drawing.turn(o, 48, 70, -10),
        svg_drawing.name((548, 62), "m", "O", "−"),
        svg_drawing.arrow(c, (320, 258)),
        svg_drawing.name((346, 256), "Mg"),
        svg_drawing.arrow((148, 188), (308, 128), "line"),
        svg_drawing.name((214, 148), "c"),
        svg_drawing.arrow((136, 156), (456, 36), "line"),
        svg_drawing.name((286, 84), "r"),
    )


def a_pin() -> str:
    """What passes a pin, and what is new behind it."""
    a, p, b = (70, 190), (310, 130), (520, 230)
    return svg_drawing.page(
        640,
        290,
        "Two rods on a pin: acceleration and force pass, the angular acceleration is new",
        svg_drawing.rod(a, p),
        svg_drawing.rod(p, b),
        svg_drawing.joint(p),
        svg_drawing.arrow(p, (382, 66)),
        svg_drawing.name((412, 64), "q"),
        svg_drawing.words((322, 30), "a and q pass on, m = 0"),
        svg_drawing.turn(p, 62, -10, -50),
        svg_drawing.name((398, 148), "α"),
        svg_drawing.words((452, 148), "is new"),
        svg_drawing.dot(b),
        svg_drawing.words((450, 274), "next pin, or a free tip: m = 0 there too"),
    )


def the_sweep() -> str:
    """Tips to root, root to tips."""
    points = [(70.0, 150.0), (200.0, 116.0), (330.0, 168.0), (460.0, 124.0), (580.0, 150.0)]
    pairs = list(pairwise(points))
    inward = (
        svg_drawing.arrow(((a[0] + b[0]) / 2 + 34, 62), ((a[0] + b[0]) / 2 - 34, 62))
        for a, b in pairs
    )
    outward = (
        svg_drawing.arrow(((a[0] + b[0]) / 2 - 34, 232), ((a[0] + b[0]) / 2 + 34, 232), "line")
        for a, b in pairs
    )
    return svg_drawing.page(
        660,
        292,
        "A chain: tips to root S and e are gathered, root to tips accelerations go out",
        svg_drawing.ground(points[0]),
        *(svg_drawing.rod(a, b) for a, b in pairs),
        *map(svg_drawing.joint, points[:-1]),
        svg_drawing.dot(points[-1]),
        *inward,
        *outward,
        svg_drawing.words((330, 34), "tips to root: f = S a + e, a body absorbed, a hinge crossed"),
        svg_drawing.words((330, 268), "root to tips: accelerations, then forces"),
        svg_drawing.name((600, 70), "S = 0"),
        svg_drawing.name((60, 228), "a = 0"),
    )


def ends_and_hinges() -> str:
    """The names of ends and points."""
    p, left, right = (262, 170), (470, 70), (480, 236)
    inboard = ((30, 210), (60, 120), (150, 130), (215, 160), (190, 220), (100, 250))
    outboard = ((236, 176), (290, 90), (480, 30), (520, 80), (450, 150), (540, 250), (470, 280))
    return svg_drawing.page(
        660,
        320,
        "An inboard and an outboard body, joined from Q to P, and two output ends",
        svg_drawing.blob(*inboard),
        svg_drawing.blob(*outboard),
        svg_drawing.dot((190, 182)),
        svg_drawing.dot(p),
        svg_drawing.line((190, 182), p, kind="thin"),
        svg_drawing.name((180, 212), "Q"),
        svg_drawing.name((270, 206), "P = I"),
        svg_drawing.dot(left),
        svg_drawing.name((492, 62), "O", "1"),
        svg_drawing.dot(right),
        svg_drawing.name((502, 230), "O", "2"),
        svg_drawing.arrow(p, (304, 120)),
        svg_drawing.name((330, 126), "q, m"),
        svg_drawing.words((110, 186), "inboard"),
        svg_drawing.words((396, 196), "outboard"),
        svg_drawing.words((232, 256), "hinge"),
        svg_drawing.line((228, 242), (226, 184), kind="thin"),
        svg_drawing.words((64, 296), "root"),
        svg_drawing.arrow((96, 291), (560, 291), "line"),
        svg_drawing.words((588, 296), "tips"),
    )


def a_hinge() -> str:
    """Two frames and what a hinge says of them."""
    q, p = (170, 230), (420, 130)
    return svg_drawing.page(
        640,
        300,
        "A hinge: the outboard frame at P, seen from the inboard frame at Q",
        svg_drawing.axes(q, 0, 70),
        svg_drawing.axes(p, 34, 70),
        svg_drawing.dot(q),
        svg_drawing.dot(p),
        svg_drawing.name((156, 252), "Q"),
        svg_drawing.name((424, 156), "P"),
        svg_drawing.arrow(q, (412, 133), "push"),
        svg_drawing.name((270, 170), "d(q)"),
        svg_drawing.line(p, (510, 130), kind="thin"),
        svg_drawing.turn(p, 56, 0, 24),
        svg_drawing.name((506, 118), "R(q)"),
        svg_drawing.words((170, 284), "inboard axes"),
        svg_drawing.words((450, 200), "outboard axes"),
        svg_drawing.name((470, 262), "[v; w] = H(q) u"),
    )


def a_loop() -> str:
    """A ring of bodies, cut at one hinge."""
    ring = [(110, 220), (150, 90), (300, 60), (392, 118)]
    back = [(408, 132), (470, 220)]
    return svg_drawing.page(
        640,
        300,
        "A loop cut at one hinge: what held it are multipliers, with both signs",
        svg_drawing.ground((96, 220)),
        svg_drawing.line((470, 250), (440, 250)),
        svg_drawing.line((455, 232), (455, 250)),
        *(svg_drawing.rod(a, b) for a, b in pairwise(ring)),
        svg_drawing.rod(*back),
        *map(svg_drawing.joint, (*ring[:3], back[1])),
        svg_drawing.dot(ring[3]),
        svg_drawing.dot(back[0]),
        svg_drawing.arrow((408, 132), (476, 84)),
        svg_drawing.name((512, 86), "N x"),
        svg_drawing.arrow((392, 118), (330, 164)),
        svg_drawing.name((306, 184), "N x", sign="−"),
        svg_drawing.line((372, 164), (430, 88), kind="thin"),
        svg_drawing.words((448, 50), "cut here: a tree is left"),
        svg_drawing.name((280, 262), "N · (difference of accelerations) = 0"),
    )


def floating_frame() -> str:
    """A beam that bends, and the frame that it bends in."""
    bent = [(110 + 4 * k, 220 - 0.5 * k - 52 * sin(k / 100 * 1.6) * k / 100) for k in range(101)]
    straight = (bent[0], (510.0, 170.0))
    high = [(x - 6, y - 15) for x, y in bent]
    low = [(x + 6, y + 15) for x, y in bent]
    outline = " ".join(f"{x:.1f} {y:.1f}" for x, y in (*high[::4], *low[::-4]))
    return svg_drawing.page(
        640,
        320,
        "A beam that bends, in the frame that floats with its input end",
        f'<path class="body" d="M{outline}z"/>',
        svg_drawing.line(*straight, kind="thin"),
        svg_drawing.axes(bent[0], 7, 74),
        svg_drawing.dot(bent[0]),
        svg_drawing.name((98, 244), "I"),
        svg_drawing.dot((390.0, 185.0)),
        svg_drawing.dot(bent[70]),
        svg_drawing.arrow((390.0, 185.0), bent[70]),
        svg_drawing.name((384, 118), "Ψ(x) η"),
        svg_drawing.name((394, 210), "x"),
        svg_drawing.dot(bent[100]),
        svg_drawing.name((534, 122), "O"),
        svg_drawing.arrow((40, 290), (104, 226), "line"),
        svg_drawing.name((54, 256), "r", "I"),
        svg_drawing.axes((40, 290), 0, 60),
        svg_drawing.words((330, 300), "place = motion of the frame + what the shapes add in it"),
    )


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
