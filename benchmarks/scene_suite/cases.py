"""The eight scenes: scene, duration, and the end whose final position is compared."""

from __future__ import annotations

import math
from functools import partial

from ..common import scenes as rigid
from ..common.flexible_scenes import Spin
from ..stiff import scenes as stiff
from ..stiff.cases import Case

#: Bodies of the long chain, and how far its first rod is turned at the start, rad.
_LINK_COUNT, _INITIAL_ANGLE = 100, 0.3
#: Rods on bushings: how many, N/m, damping ratio.
_BUSHINGS = (10, 1e8, 0.01)


def long_chain() -> rigid.Scene:
    """A hundred rods of 1 m hanging in a plane, rotated as a whole and released."""
    zeros = [[0.0]] * _LINK_COUNT
    return rigid.hanging_chain(rigid.planar(_LINK_COUNT), [[_INITIAL_ANGLE], *zeros[1:]], zeros)


CASES = {case.name: case for case in (
    Case("arm", "arm of three rods on pins, not stiff", rigid.swinging_arm, 10.0, ("rod2.tip",)),
    Case("balls", "three rods on balls", rigid.swinging_balls, 10.0, ("rod2.tip",)),
    Case("chain", f"chain of {_LINK_COUNT} rods", long_chain, 2.0, (f"rod{_LINK_COUNT - 1}.tip",)),
    Case("bushings", f"{_BUSHINGS[0]} rods on stiff bushings, 1e{math.log10(_BUSHINGS[1]):g} N/m",
         partial(stiff.bushed_rods, *_BUSHINGS), 1.0, (f"rod{_BUSHINGS[0] - 1}.tip",),
         bushings=_BUSHINGS),
    Case("springs", "arm whose pins are springs and dampers",
         partial(rigid.example, "three_pin_arm_springs"), 1.0, ("body3.tip",)),
    Case("pendulum", "flexible pendulum, four shapes", partial(stiff.falling_beam, 4, 500.0, 0.0),
         1.0, ("beam.tip",)),
    Case("spin-up", "beam spun up, three shapes", partial(Spin.scene, 3), Spin.T_END,
         ("blade.tip",)),
    Case("satellite", "satellite with two flexible panels",
         partial(rigid.example, "satellite_panels"), 10.0, ("east.tip",)),
)}  # fmt: skip

#: Scenes of links on pins and balls without laws, for programs of rigid trees.
TREES = ("arm", "balls", "chain")
